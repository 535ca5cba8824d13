"""Keypoints of pose trackers: choice of animal and order, and repair of missing points.

Pixel rows count downwards. Points with a low score are missing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import scipy  # scipy.interpolate loads when it is first used
from scipy.sparse.csgraph import minimum_spanning_tree

from snakewalk.config.arrays import Bools, Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.reading import Facts
from snakewalk.controller.track.choice import FEWEST, Choice
from snakewalk.controller.track.exchanged_ends import with_ends_in_place
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.track import Track, track_from_points

KEYPOINT_RATE_HZ = 30.0
"""Default where a file of keypoints holds no frame rate."""
_MISSING = 0.25  # share of the keypoints, at least one, that may be missing in a frame
_ZIGZAG = 1.5  # above it the order cannot be a body's
_TURN_ON = 0.5  # of the last turn (of 0, 0.5 and 1 the best on a recorded fish)


@dataclass(frozen=True, slots=True)
class Keypoints:
    """The keypoints of one animal."""

    file: Path
    """File of the keypoints, for faults and the name."""
    nodes: Sequence[str]
    """Names of the K keypoints."""
    places: Floats
    """(T, K, 2) to the right and upwards; NaN where nothing was seen."""
    scores: Floats | None
    """(T, K) how sure the tracker was, 0..1; None where the file holds no scores."""
    rate_hz: float | None = None
    """Frames a second; None where the file does not say."""
    least_score: float = 0.0
    """Score below which a keypoint counts as missing."""
    frame: Ints | None = None
    """(T,) frame numbers; None: 0, 1, 2..."""
    scale_m: float | None = None
    """Metres in a unit of the places; None: not known."""
    facts: Facts = field(default_factory=dict)
    """Facts about the file; of markers in space also the plane onto which they are projected."""
    notes: tuple[str, ...] = ()
    """Lines about parts that the reader left out or changed."""

    def sure(self, order: Sequence[int]) -> Floats:
        """(T, N, 2) keypoints by index, NaN if missing or below the least score.

        Raises:
            InputError: scores are missing, or too few points are left.

        """
        file = self.file
        least = self.least_score
        places = self.places[:, order]
        if len(places) < 2:
            raise InputError(f"{file}: holds {len(places)} frame; two or more are needed")
        if self.scores is None and least > 0.0:
            raise InputError(f"{file}: holds no scores to compare with a least score of {least}")
        if self.scores is not None:
            scores = self.scores[:, order]
            unsure = scores < least  # NaN: points set by hand have no score
            bad = int(unsure.any(axis=1).sum())
            if least > 0.0 and bad > len(unsure) - 2:
                worst = np.nanmedian(scores, axis=0)
                raise InputError(
                    f"{file}: in {bad} of {len(unsure)} frames a keypoint scores less than "
                    f"{least:g} (keypoint {int(np.argmin(worst)) + 1}, the least sure, "
                    f"{worst.min():.2f} in the median); lower the least score, or leave it out "
                    "with --keypoints"
                )
            places = np.where(unsure[..., None], np.nan, places)
        is_visible = np.asarray(np.isfinite(places).any(axis=(0, 2)))
        unseen_nodes = [
            self.nodes[k] for k, there in zip(order, is_visible, strict=True) if not there
        ]
        if unseen_nodes and len(unseen_nodes) < len(order):
            raise InputError(
                f"{file}: {', '.join(unseen_nodes)} is never seen; list the others as "
                f"`keypoints = [...]` in {file.name}.reading.toml"
            )
        return places

    def midline(self, choice: Choice) -> tuple[Floats, Bools]:
        """(T, N, 2) keypoints of the midline by ``bridge``, and the frames in which one was set.

        Raises:
            InputError: as ``sure``, an unknown keypoint, or an order that cannot be a body's.

        """
        choice.only(self.file, "a file of keypoints", "individual", "keypoints", "plane")
        places = self.sure(choice.order(self.file, self.nodes))
        if choice.keypoints is None and zigzag(places) > _ZIGZAG:
            raise InputError(
                f"{self.file}: its keypoints do not lie one after the other along a body: "
                f"{', '.join(self.nodes)}; give --keypoints with those of the midline, head first"
            )
        return bridge(places)

    def track(self, choice: Choice) -> Track:
        """Make a track of the midline; an unknown rate is assumed, and marked as such.

        Raises:
            InputError: as ``midline``, or of ``track_from_points``.

        """
        bridged, which = self.midline(choice)
        number = np.arange(len(bridged)) if self.frame is None else self.frame
        is_complete = np.isfinite(bridged).all(axis=(1, 2))
        bridged = bridged.copy()
        bridged[is_complete], exchanged = with_ends_in_place(
            bridged[is_complete], number[is_complete]
        )
        status = [FrameStatus.BRIDGED if is_bridged else FrameStatus.GOOD for is_bridged in which]
        track = track_from_points(
            self.file.stem,
            bridged,
            KEYPOINT_RATE_HZ if self.rate_hz is None else self.rate_hz,
            frame=self.frame,
            scale_m=self.scale_m,
            rate_assumed=self.rate_hz is None,
            status=status,
        )
        return replace(track, notes=(*self.notes, *exchanged))


def zigzag(places: Floats) -> float:
    """Length of the polyline through (T, K, 2), divided by the shortest tree's; 1: a body."""
    distance = np.hypot(*(places[:, :, None] - places[:, None]).transpose(3, 0, 1, 2))
    is_visible = np.isfinite(distance).any(axis=0)
    if not is_visible.all():
        return 1.0
    usual = np.nanmedian(distance, axis=0)
    least = float(minimum_spanning_tree(usual).sum())
    return float(usual.diagonal(1).sum()) / least if least > 0.0 else 1.0


def bridge(places: Floats) -> tuple[Floats, Bools]:
    """Set single missing points (T, K, 2) on the curve through the others of their frame.

    An inner point goes on the cubic spline, at its usual arc length. An end point goes to its usual
    distance, and half of the body's last turn continues. At most a quarter of the points, at least
    one, may be missing, but no two neighbours; four must be seen.

    Returns:
        The points, and (T,) frames in which one was set.

    """
    lost = np.asarray(~np.isfinite(places).all(axis=2))
    count = places.shape[1]
    most = min(max(1, int(_MISSING * count)), count - FEWEST)
    may_fill = (
        lost.any(axis=1) & (lost.sum(axis=1) <= most) & ~(lost[:, 1:] & lost[:, :-1]).any(axis=1)
    )
    step = np.hypot(*np.diff(places, axis=1).transpose(2, 0, 1))
    is_known = np.isfinite(step).any(axis=0)
    if not (may_fill.any() and is_known.all()):
        return places, np.zeros(len(places), dtype=bool)
    usual = np.nanmedian(step, axis=0)
    along = np.concatenate([[0.0], np.cumsum(usual)])
    out = places.copy()
    for k in np.flatnonzero(may_fill):
        is_visible = ~lost[k]
        curve = scipy.interpolate.CubicSpline(along[is_visible], places[k, is_visible])
        out[k, lost[k]] = curve(along[lost[k]])
        if lost[k, 0]:
            out[k, 0] = _point_beyond(out[k, 1], out[k, 2], out[k, 3], usual[0])
        if lost[k, -1]:
            out[k, -1] = _point_beyond(out[k, -2], out[k, -3], out[k, -4], usual[-1])
    return out, may_fill


def _point_beyond(last: Floats, second: Floats, third: Floats, reach: float) -> Floats:
    """The point beyond an end: half of the last turn continues."""
    heading = np.arctan2(*(last - second)[::-1])
    turn = np.angle(np.exp(1j * (heading - np.arctan2(*(second - third)[::-1]))))
    heading_rad = heading + _TURN_ON * turn
    return last + reach * np.array([np.cos(heading_rad), np.sin(heading_rad)])
