"""Head and tail keep their identity over time.

From frame to frame the body is compared with itself and with itself reversed; over a gap its
thickness along the body decides as well. ``head`` finds which end is the head.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.track.frame_status import FrameStatus

_SURE_MARGIN = 0.2  # margin from which one frame is enough to distinguish the ends
_GAP = 3  # frames without a skeleton after which the place alone is not enough


def margin_of(body: Skeleton, before: Skeleton) -> float:
    """1: fits ``before`` exactly as it is; -1: fits exactly reversed; 0: undecided.

    Places count, not only shapes, but a common shift of all points does not.
    """
    point = body.points_px - body.points_px.mean(axis=0)
    there = before.points_px - before.points_px.mean(axis=0)
    same_order_px = float(np.hypot(*(point - there).T).mean())
    other = float(np.hypot(*(point[::-1] - there).T).mean())
    return (other - same_order_px) / max(other + same_order_px, 1e-9)


def align_ends(skeletons: Sequence[Skeleton]) -> tuple[Skeleton, ...]:
    """Put the same end first in every frame; the end of the first skeleton is kept."""
    out = list(skeletons)
    good = [k for k, skeleton in enumerate(out) if skeleton.status is FrameStatus.GOOD]
    profile = np.zeros(0)
    for number, k in enumerate(good):
        if number == 0:
            profile = _asymmetry(out[k])
            continue
        before = good[number - 1]
        margin = margin_of(out[k], out[before])
        if abs(margin) < _SURE_MARGIN or k - before > _GAP:
            thick = _agreement(_asymmetry(out[k]), profile)
            margin = margin if abs(margin) > 2.0 * abs(thick) else thick
        if margin < 0.0:
            out[k] = out[k].reversed()
        profile = profile + (_asymmetry(out[k]) - profile) / min(number + 1, 200)
    return tuple(out)


def margins(skeletons: Iterable[Skeleton]) -> Floats:
    """(T,) how much better each fits the one before as it is than reversed, -1 to 1.

    NaN for a frame without a skeleton, 1 at the first one. Below 0 where thickness overruled the
    place in ``align_ends``.
    """
    return np.fromiter(_margins(skeletons), dtype=float)


def _margins(skeletons: Iterable[Skeleton]) -> Iterator[float]:
    before: Skeleton | None = None
    for skeleton in skeletons:
        if not np.isfinite(skeleton.length_px):
            yield float("nan")
            continue
        yield 1.0 if before is None else margin_of(skeleton, before)
        before = skeleton


def _asymmetry(body: Skeleton) -> Floats:
    """(50,) thickness from the first end minus that from the other, of the mean thickness."""
    radius = body.radius_px / body.radius_px.mean()
    return np.asarray((radius - radius[::-1])[:50])


def _agreement(vector: Floats, other: Floats) -> float:
    """-1 to 1: whether two asymmetries have the same sign; about 0 where there is hardly one."""
    scale = float(np.abs(other).mean())
    squares = float(vector @ vector + other @ other)
    product = 2.0 * float(vector @ other) / max(squares, 1e-12)
    return product * min(1.0, scale / 0.1)
