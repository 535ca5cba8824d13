"""Text without the characters that steer a terminal or reorder what a reader sees.

Names come from files of other people: a robot's model, a log, a recording.
"""

import re
from typing import Final

DIRECTION: Final = "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"
"""Characters of a regular expression's set: marks that change the direction of text (UAX 9)."""
LINE_ENDS: Final = "\u2028\u2029"
_CONTROL: Final = re.compile(f"[\x00-\x08\x0b-\x1f\x7f-\x9f{DIRECTION}{LINE_ENDS}]")


def plain(text: str) -> str:
    """Return a text in which a question mark stands for each such character."""
    return _CONTROL.sub("?", text)
