"""Whether the body of a frame is usable, and why not."""

from collections.abc import Sequence
from enum import StrEnum


class FrameStatus(StrEnum):
    """Verdict on a frame; those down to ``COIL`` hold points."""

    GOOD = "good"
    ROUGH = "rough: the points may be off by more than 1 % of the body"
    BRIDGED = "rough: a keypoint was not seen; it lies on the curve through the others"
    BY_HAND = "by hand: a person drew the points"
    COIL = "touches itself or something: solved by the film's body"
    MISSING = "keypoints are missing"
    NOTHING = "nothing seen"
    SEVERAL = "several animals"
    MERGED = "touches another animal: one silhouette shows several"
    CUT = "cut by the edge of the image"
    LOOP = "touches itself: the silhouette has a hole"
    BRANCH = "touches itself: the medial axis branches"
    SHORT = "touches itself: much shorter or thicker than in the other frames"
    COIL_TWO_WAYS = "touches itself: the frames before and after it give two different solutions"
    COIL_UNLIKE = "touches itself: the film's body does not explain the picture"
    COIL_ALONE = "touches itself: no good frame on one of both sides"
    LARGER = "touches something: longer or larger than in the other frames"
    PART = "a part is missing: something goes on beyond its end"
    GHOST = "the background shows the animal"
    BLOB = "not a long body"
    EMPTY = "rejected: the body does not stand out from the ground along the line"
    KNOT = "rejected: a bend or a loop is tighter than the body's width allows"
    LENGTH = "rejected: the length lies outside the film's range"
    LEFT_OUT = "left out by a person"

    @property
    def has_points(self) -> bool:
        """Whether the frame holds points."""
        return self in {
            FrameStatus.GOOD,
            FrameStatus.ROUGH,
            FrameStatus.BRIDGED,
            FrameStatus.BY_HAND,
            FrameStatus.COIL,
        }


def statuses_named(words: Sequence[str]) -> list[FrameStatus]:
    """Statuses by their names in lower case; an empty list if one is unknown."""
    status_by_name = {frame_status.name.lower(): frame_status for frame_status in FrameStatus}
    return [status_by_name[word] for word in words] if status_by_name.keys() >= set(words) else []
