"""Text without characters that control the terminal or reorder the display.

Names come from foreign files: a robot's model, a log, a recording.
"""

import re

DIRECTION = "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"
"""Characters of a regular expression's set: marks that change the direction of text (UAX 9)."""
LINE_ENDS = "\u2028\u2029"
_CONTROL = re.compile(f"[\x00-\x08\x0b-\x1f\x7f-\x9f{DIRECTION}{LINE_ENDS}]")


def plain(text: str) -> str:
    """Return a text with a question mark in place of each such character."""
    return _CONTROL.sub("?", text)
