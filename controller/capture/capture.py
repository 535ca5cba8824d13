"""A whole recording: every frame seen, judged beside the others, and followed."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.body_detector import Eye
from snakewalk.controller.capture.frame_status import Verdict
from snakewalk.controller.capture.identity import follow, margins, taper_of, travel_of
from snakewalk.controller.capture.image.medial_axis import Skeleton
from snakewalk.controller.capture.outlier_frames import beside_the_others
from snakewalk.controller.capture.small_body.blur_estimate import (
    axis_error_px,
    blur_of,
    softness_px,
)
from snakewalk.controller.capture.small_body.crop import LONGEST_PX, Glimpse, glimpse
from snakewalk.controller.capture.small_body.fit import refine
from snakewalk.controller.capture.track import track_from_points
from snakewalk.controller.capture.wave import measure_wave

_COMPANY = 0.08  # of the body: more than dirt and noise
_FOLLOWED = 5  # frames for which a small body that was lost may be where it was
_STILL = 0.02  # of the length: less change than that is no motion
_TRAVEL = 0.2  # from which the way it travels says which end is the head
_TRAVEL_S = 0.25


@dataclass(frozen=True, slots=True)
class Capture:
    """A recording as skeletons; all its T frames, NaN where neither ``good`` nor ``rough``."""

    points_px: Floats
    """(T, 101, 2) x, y, head first, 100 equal chords; y downwards."""
    radius_px: Floats
    """(T, 101) half the body's thickness."""
    length_px: Floats
    """(T,)"""
    verdict: tuple[Verdict, ...]
    expected_px: Floats
    """(T,) expected mean error of a point; NaN where there is none. Above a hundredth of the length
    the verdict is ``rough``: the points are there, but not as good as is wanted."""
    company: Floats
    """(T,) size of the next largest thing that stands out, of the body's."""
    margin: Floats
    """(T,) how surely the head is where it was in the frame before: ``identity.Followed``."""
    rate_hz: float
    head_by: str
    """How the head was told from the tail: ``given``, ``travel``, ``wave`` or ``taper``."""
    head_sure: float
    """0 to 1, of that."""

    @property
    def good(self) -> NDArray[np.bool_]:
        """(T,) frames whose points are expected within a hundredth of the length."""
        return np.array([one is Verdict.GOOD for one in self.verdict])

    @property
    def used(self) -> NDArray[np.bool_]:
        """(T,) frames that hold a skeleton, good or rough."""
        return np.asarray(np.isfinite(self.length_px))

    @property
    def accompanied(self) -> NDArray[np.bool_]:
        """(T,) frames in which something else stands out, no speck: perhaps a small animal."""
        return self.company > _COMPANY

    @property
    def counts(self) -> dict[str, int]:
        """Frames of each verdict that occurs."""
        return {str(v): self.verdict.count(v) for v in Verdict if v in self.verdict}


def capture(
    frames: Iterable[Image],
    eye: Eye,
    rate_hz: float,
    *,
    name: str = "recording",
    head_px: tuple[float, float] | None = None,
    fixed: bool = True,
    seen: Callable[[], None] | None = None,
) -> Capture:
    """See every frame, in order.

    Args:
        frames: (H, W) or (H, W, 3), 8 bit.
        eye: from ``open_eye``.
        rate_hz: frames a second.
        name: for faults.
        head_px: a place near the head in the first frame that can be used.
        fixed: whether the camera stands still; images cropped to the animal tell no travel.
        seen: called after each frame.

    Raises:
        InputError: fewer than 2 frames can be used, or nothing moves.

    """
    found: list[Skeleton] = []
    area: list[float] = []
    company: list[float] = []
    expected: list[float] = []
    glimpses: dict[int, Glimpse] = {}
    last, points = -_FOLLOWED - 1, np.empty((0, 2))
    for number, frame in enumerate(frames):
        look = eye.see(frame)
        body = look.skeleton
        found.append(body)
        area.append(look.silhouette.area_px)
        company.append(look.silhouette.company)
        expected.append(np.nan)
        if body.length_px <= LONGEST_PX:
            last, points = number, body.points_px
            glimpses[number] = glimpse(frame, look.ground, points)
        elif body.verdict is Verdict.GOOD:
            soft = softness_px(look.silhouette.level, look.silhouette.threshold)
            expected[-1] = axis_error_px(blur_of(soft), body.length_px)
        elif body.verdict is Verdict.BLOB and number - last <= _FOLLOWED:
            glimpses[number] = glimpse(frame, look.ground, points)
        if seen is not None:
            seen()
    judged = beside_the_others(follow(found).skeletons, np.array(area))
    if sum(one.verdict is Verdict.GOOD for one in judged) < 2:
        raise InputError(f"{name}: {_fault(judged)}")
    followed = follow(judged)
    points = np.stack([one.points_px for one in followed.skeletons])
    radius = np.stack([one.radius_px for one in followed.skeletons])
    if _change(points) < _STILL:
        raise InputError(
            f"{name}: no motion: the body changes by less than {_STILL:.0%} of its length in "
            f"{len(points)} frames"
        )
    score, by = _head_first(points, radius, rate_hz, head_px, fixed=fixed)
    skeletons = [one.reversed() if score < 0.0 else one for one in followed.skeletons]
    refined = refine(skeletons, glimpses, followed.margin, np.array(expected), fixed=fixed)
    return Capture(
        points_px=np.stack([one.points_px for one in refined.skeletons]),
        radius_px=np.stack([one.radius_px for one in refined.skeletons]),
        length_px=np.array([one.length_px for one in refined.skeletons]),
        verdict=tuple(one.verdict for one in refined.skeletons),
        expected_px=refined.expected_px,
        company=np.array(company),
        margin=margins(refined.skeletons),
        rate_hz=rate_hz,
        head_by=by,
        head_sure=min(1.0, abs(score)),
    )


def _fault(judged: list[Skeleton]) -> str:
    said = [one.verdict for one in judged if one.verdict is not Verdict.GOOD]
    if not said:
        return f"{len(judged)} frame: two or more are needed"
    worst = max(dict.fromkeys(said), key=said.count)
    advice = {
        Verdict.NOTHING: "no contrast or no motion: nothing stands out from the background; give "
        "--background, or better light",
        Verdict.SEVERAL: "several animals: cut the film so that one is in view",
        Verdict.CUT: "the body is cut by the edge of the image",
        Verdict.BLOB: "what stands out is not a long body; give --background",
    }.get(worst, f"the body is never seen whole: {worst}")
    return f"{advice} ({said.count(worst)} of {len(judged)} frames)"


def _change(points: Floats) -> float:
    """Greatest mean change of place or shape since the first frame, in body lengths."""
    good = points[np.isfinite(points[:, 0, 0])]
    length = float(np.hypot(*np.diff(good[0], axis=0).T).sum())
    return float(np.hypot(*(good - good[0]).transpose(2, 0, 1)).mean(axis=1).max()) / length


def _head_first(
    points: Floats,
    radius: Floats,
    rate_hz: float,
    head_px: tuple[float, float] | None,
    *,
    fixed: bool,
) -> tuple[float, str]:
    """Above 0 where the first end is the head, and what said so."""
    good = np.isfinite(points[:, 0, 0])
    if head_px is not None:
        first = points[np.argmax(good)]
        one, other = (float(np.hypot(*(first[k] - head_px))) for k in (0, -1))
        return (1.0 if one <= other else -1.0), "given"
    if fixed:
        travel = travel_of(points, max(1, round(_TRAVEL_S * rate_hz)))
        if abs(travel) > _TRAVEL:
            return travel, "travel"
    if int(good.sum()) >= 8:
        wave = measure_wave(track_from_points("", points, rate_hz))
        if abs(wave.headward - 0.5) > 0.05:
            return 1.0 - 2.0 * wave.headward, "wave"
    return taper_of(radius[good]), "taper"
