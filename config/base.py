"""The strict base of every schema: unknown keys are faults, values are frozen."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, StringConstraints

_NOT_IN_NAMES = r"/\\\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""Folders, and the characters of ``plain_text``."""
NAME_PATTERN = f"^[^.{_NOT_IN_NAMES}][^{_NOT_IN_NAMES}]*$"
Name = Annotated[str, StringConstraints(min_length=1, max_length=100, pattern=NAME_PATTERN)]
"""A name that becomes part of a file's: no path, nothing that steers a terminal, not hidden."""
STOP_OUTPUT_PATTERN = r"^(-?(rts|dtr):.+|command:/.+)$"
PATTERNS_IN_WORDS = {
    NAME_PATTERN: "holds '/', a control character or a leading dot",
    STOP_OUTPUT_PATTERN: "must be rts:PORT, -rts:PORT, dtr:PORT, -dtr:PORT or "
    "command:/PROGRAM ARGUMENT",
}
"""Messages for texts that do not match; those of simple patterns are derived from the pattern."""


class Strict(BaseModel):
    """Frozen, refuses unknown keys, NaN and infinities."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
