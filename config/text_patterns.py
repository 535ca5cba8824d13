"""Patterns of texts in configuration files, and their messages."""

_NOT_IN_NAMES = r"/\\\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""Folders, and the characters of ``plain_text``."""
NAME_PATTERN = f"^[^.{_NOT_IN_NAMES}][^{_NOT_IN_NAMES}]*$"
STOP_OUTPUT_PATTERN = r"^(-?(rts|dtr):.+|command:/.+)$"
PATTERNS_IN_WORDS = {
    NAME_PATTERN: "holds '/', a control character or a leading dot",
    STOP_OUTPUT_PATTERN: "must be rts:PORT, -rts:PORT, dtr:PORT, -dtr:PORT or "
    "command:/PROGRAM ARGUMENT",
}
"""Messages for texts that do not match; those of simple patterns are derived from the pattern."""
