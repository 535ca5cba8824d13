"""Whether the body of one frame can be used, and if not, why."""

from enum import StrEnum


class FrameStatus(StrEnum):
    """``GOOD`` and ``ROUGH`` frames hold points. Of every other one only the reason is kept."""

    GOOD = "good"
    ROUGH = "rough: the points may be off by more than 1 % of the body"
    NOTHING = "nothing seen"
    SEVERAL = "several animals"
    CUT = "cut by the edge of the image"
    LOOP = "touches itself: the silhouette has a hole"
    BRANCH = "touches itself: the medial axis branches"
    SHORT = "touches itself: much shorter or thicker than in the other frames"
    LARGER = "touches something: longer or larger than in the other frames"
    PART = "a part is missing: something goes on beyond its end"
    GHOST = "the background shows the animal"
    BLOB = "not a long body"

    @property
    def has_points(self) -> bool:
        """Whether the frame holds points."""
        return self in {FrameStatus.GOOD, FrameStatus.ROUGH}
