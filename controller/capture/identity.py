"""Head and tail keep their identity over time, and which end the head is.

From frame to frame the body is compared with itself and with itself reversed; over a gap its
thickness along the body decides as well. The user may name the head; else the direction of travel,
the direction of the wave, and the taper add their log-odds.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.track import track_from_points
from snakewalk.controller.track.wave import measure_wave

_SURE_MARGIN = 0.2  # margin from which one frame is enough to distinguish the ends
_WAVE_FRAMES = 8  # from which a wave's direction is looked at
_BY_TRAVEL = 4.0  # log-odds of the first end, by its sign (from films with known heads)
_BY_SLOW_TRAVEL = 1.0  # the same where the travel may be that of the camera
_BY_WAVE = 4.0
_BY_TAPER, _MOST_BY_TAPER = 8.0, 6.0
_EVEN_TAPER = 0.1  # of the mean thickness: a smaller taper says nothing
_WEAKER_SHARE = (
    0.5  # share of the weaker of travel and wave: both turn if an animal moves backwards
)
_DECIDES = 1.0  # log-odds from which a sign is named as the reason, in the order of the signs
_TRAVEL_S = 0.25
_TRAVEL_PX = 1.0  # over that time; less is what a camera that goes with the animal by pixels leaves
_TRAVEL_OF_WAVE = 0.075  # of the wave's speed: less travel is that of the camera, not of the animal
_CONTRARY = 0.25  # of the mean thickness: a taper that contradicts the motion
_DOUBTED_SCORE = 0.2  # certainty of a head that the taper contradicts: an animal may move backwards
_GAP = 3  # frames without a skeleton after which the place alone is not enough


@dataclass(frozen=True, slots=True)
class AlignedSkeletons:
    """Skeletons of one animal, the same end first in all."""

    skeletons: tuple[Skeleton, ...]
    margin: Floats
    """(T,) how much better the frame fits as it is than reversed, -1 to 1; NaN for a frame without
    a skeleton, 1 at the first one. Below 0 where thickness overruled the place."""


def margin_of(body: Skeleton, before: Skeleton) -> float:
    """1: fits ``before`` exactly as it is; -1: fits exactly reversed; 0: undecided.

    Places count, not only shapes, but a common shift of all points does not.
    """
    point = body.points_px - body.points_px.mean(axis=0)
    there = before.points_px - before.points_px.mean(axis=0)
    same_order_px = float(np.sqrt(((point - there) ** 2).sum(axis=1)).mean())
    other = float(np.sqrt(((point[::-1] - there) ** 2).sum(axis=1)).mean())
    return (other - same_order_px) / max(other + same_order_px, 1e-9)


def align_ends(skeletons: Sequence[Skeleton]) -> AlignedSkeletons:
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
    return AlignedSkeletons(tuple(out), margins(out))


def margins(skeletons: Iterable[Skeleton]) -> Floats:
    """(T,) how much better each fits the one before as it is than reversed: ``align_ends``."""
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
    product = float(
        (vector * other).sum() / max(np.hypot(*_norms(vector, other)) ** 2 / 2.0, 1e-12)
    )
    return product * min(1.0, scale / 0.1)


def _norms(vector: Floats, other: Floats) -> tuple[float, float]:
    return float(np.linalg.norm(vector)), float(np.linalg.norm(other))


def travel_score(points_px: Floats, step: int) -> float:
    """Whether the first end leads, -1 to 1: travel along the body's direction over all travel.

    Args:
        points_px: (T, P, 2), NaN where the body was not found.
        step: frames over which travel is measured; long enough that noise of a frame is small.

    Returns:
        0 where the body does not travel by more than a hundredth of its length in a step.

    """
    ahead = points_px[:, 0] - points_px[:, -1]
    unit = ahead / np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    middle = points_px.mean(axis=1)
    moved = middle[step:] - middle[:-step]
    along = (moved * unit[:-step]).sum(axis=1)
    distance = np.hypot(*moved.T)
    use = np.isfinite(along) & (distance > 0.01 * median_length(points_px))
    return float(along[use].sum() / distance[use].sum()) if use.any() else 0.0


def usual_travel(points_px: Floats, step: int) -> float:
    """Median travel of the middle of the body (T, P, 2) in ``step`` frames; 0: not known."""
    middle = points_px.mean(axis=1)
    moved = np.hypot(*(middle[step:] - middle[:-step]).T)
    return float(np.nanmedian(moved)) if np.isfinite(moved).any() else 0.0


def median_length(points_px: Floats) -> float:
    """Median length of the bodies (T, P, 2)."""
    return float(np.nanmedian(np.hypot(*np.diff(points_px, axis=1).transpose(2, 0, 1)).sum(axis=1)))


def taper_score(radius_px: Floats) -> float:
    """How much thicker the first fifth (without the tip) is than the last one, of the mean."""
    mean = np.nanmean(radius_px, axis=0)
    count = len(mean)
    head_half, other = mean[count // 20 : count // 5], mean[::-1][count // 20 : count // 5]
    return float((head_half.mean() - other.mean()) / mean.mean())


def head_end(
    points: Floats,
    radius: Floats,
    rate_hz: float,
    head_px: tuple[float, float] | None,
    *,
    fixed: bool,
) -> tuple[float, str]:
    """Which end is the head: given, or by the log-odds of travel, wave and taper.

    Both motions turn together if an animal moves backwards, so the weaker one counts half. If a
    clear taper contradicts the motion, the score is at most ``_DOUBTED_SCORE``.

    Args:
        points: (T, P, 2) pixels, the same end first in all; NaN for a frame without a body.
        radius: (T, P) half the thickness.
        rate_hz: frames a second.
        head_px: a place near the head in the first frame with a body.
        fixed: whether the camera stands still.

    Returns:
        A score from -1 to 1, above 0 where the first end is the head, and its strongest reason.
        ``(1 + score) / 2`` is the probability of the first end.

    """
    good = np.isfinite(points[:, 0, 0])
    if head_px is not None:
        first = points[np.argmax(good)]
        first_px, other = (float(np.hypot(*(first[k] - head_px))) for k in (0, -1))
        return (1.0 if first_px <= other else -1.0), "given"
    wave = None
    if int(good.sum()) >= _WAVE_FRAMES:
        wave = measure_wave(track_from_points("", points, rate_hz))
    by_travel = 0.0
    if fixed:
        step = max(1, round(_TRAVEL_S * rate_hz))
        least_px = _TRAVEL_PX
        if wave is not None:
            pulse = abs(wave.pulse_body_lengths_s) * median_length(points) * step / rate_hz
            least_px = max(least_px, _TRAVEL_OF_WAVE * pulse)
        usual_px = usual_travel(points, step)
        weight = _BY_TRAVEL if usual_px > least_px else _BY_SLOW_TRAVEL * (usual_px > _TRAVEL_PX)
        by_travel = weight * travel_score(points, step)
    by_wave = 0.0 if wave is None else _BY_WAVE * (1.0 - 2.0 * wave.headward)
    weaker, stronger = sorted((by_travel, by_wave), key=abs)
    taper = taper_score(radius[good])
    return _weighed_score(
        stronger + _WEAKER_SHARE * weaker, taper, {"travel": by_travel, "wave": by_wave}
    )


def _weighed_score(motion: float, taper: float, signs: dict[str, float]) -> tuple[float, str]:
    """The score by the log-odds of the motion and by a taper, and its reason among all signs."""
    by_taper = np.copysign(
        min(_BY_TAPER * max(abs(taper) - _EVEN_TAPER, 0.0), _MOST_BY_TAPER), taper
    )
    total = motion + float(by_taper)
    signs = {**signs, "taper": float(by_taper)}
    agreeing = {by: abs(sign) for by, sign in signs.items() if sign * total > 0.0}
    if not agreeing:
        return taper, "taper"
    clear = (by for by, strength in agreeing.items() if strength >= _DECIDES)
    by = next(clear, max(agreeing, key=lambda name: agreeing[name]))
    score = float(np.tanh(0.5 * total))
    if motion * taper < 0.0 and abs(taper) >= _CONTRARY:
        score = float(np.clip(score, -_DOUBTED_SCORE, _DOUBTED_SCORE))
    return score, by
