"""What is to be said of the body in one frame."""

from enum import StrEnum


class Verdict(StrEnum):
    """``GOOD``: the skeleton can be used. Of every other frame only the reason is kept."""

    GOOD = "good"
    NOTHING = "nothing seen"
    SEVERAL = "several animals"
    CUT = "cut by the edge of the image"
    LOOP = "touches itself: the silhouette has a hole"
    BRANCH = "touches itself: the medial axis branches"
    SHORT = "touches itself: much shorter or thicker than in the other frames"
    BLOB = "not a long body"
