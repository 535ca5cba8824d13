"""Which end of a body is the head: one likelihood over a film, of five signs.

Each sign is a number that is positive if the first end is the head. Its mean and its variance
between films come from films with known heads; the variance within the film adds to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.staged_film import StagedFilm, arrays_of
from snakewalk.controller.capture.verification.frame_store import FrameStore
from snakewalk.controller.capture.verification.profiles import body_profile
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.track.track import track_from_points
from snakewalk.controller.track.wave import measure_wave

_WAVE_FRAMES = 8  # from which a wave's direction is looked at
_TRAVEL_S = 0.25
_JITTER_PX = 1.0  # travel that a camera leaves that follows the animal by whole pixels
_FRONT = slice(5, 20)  # of 101 stations: an end without its tip
_TIP = slice(2, 7)
_EYES = slice(3, 16)
_MOST_ODDS = 50.0
_EVEN = 0.1  # of the mean: ends that differ by less are alike
_PICTURES = 20  # frames whose contrast along the body is measured


@dataclass(frozen=True, slots=True)
class Sign:
    """Distribution of a sign over films whose first end is the head."""

    mean: float
    deviation: float


@dataclass(frozen=True, slots=True)
class SignGroup:
    """Signs that err together."""

    signs: dict[str, Sign]
    contrary: float
    """Share of films in which all of them show the other end."""
    repeated: float
    """How often the same information occurs among them, by their correlation."""


GROUPS = (
    SignGroup({"travel": Sign(0.8, 0.45), "wave": Sign(0.75, 0.6)}, 0.12, 2.0),
    SignGroup(
        {"taper": Sign(0.37, 0.45), "width": Sign(0.33, 0.45), "eyes": Sign(0.31, 0.45)}, 0.03, 2.55
    ),
)
"""Learnt by ``python -m benchmarks.head_signs``, except how often a group is contrary: an animal
may move backwards, and a body may be thicker or darker at its tail."""


class Identify:
    """Stage that puts the head first."""

    def run(self, film: StagedFilm) -> StagedFilm:
        """Return the film with the head first in all frames, and its probability."""
        skeletons = film.skeletons
        contrast = contrast_along(skeletons, film.detections.store)
        shown = arrays_of(skeletons)
        score, by = head_end(
            shown["points_px"],
            shown["radius_px"],
            contrast,
            film.rate_hz,
            film.head_px,
            fixed=film.fixed,
        )
        if score < 0.0:
            skeletons = tuple(skeleton.reversed() for skeleton in skeletons)
        return replace(film, skeletons=skeletons, head=(score, by))


def head_end(
    points: Floats,
    radius: Floats,
    contrast: Floats,
    rate_hz: float,
    head_px: tuple[float, float] | None,
    *,
    fixed: bool,
) -> tuple[float, str]:
    """Which end is the head: given, or by the likelihood of all signs; as ``head_signs``.

    Args:
        points: (T, P, 2).
        radius: (T, P).
        contrast: (F, P).
        rate_hz: frames a second.
        head_px: a place near the head in the first frame with a body.
        fixed: whether the camera stands still.

    Returns:
        A score from -1 to 1, above 0 where the first end is the head, and its strongest sign.
        ``(1 + score) / 2`` is the probability of the first end.

    """
    if head_px is not None:
        first = points[np.argmax(np.isfinite(points[:, 0, 0]))]
        first_px, last_px = (float(np.hypot(*(first[k] - head_px))) for k in (0, -1))
        return (1.0 if first_px <= last_px else -1.0), "given"
    signs = head_signs(points, radius, contrast, rate_hz, fixed=fixed)
    odds: dict[str, float] = {}
    total = 0.0
    for group in GROUPS:
        known = {
            name: _log_odds(sign, *signs[name])
            for name, sign in group.signs.items()
            if name in signs
        }
        ratio = np.exp(np.clip(sum(known.values()) / group.repeated, -_MOST_ODDS, _MOST_ODDS))
        right, wrong = 1.0 - group.contrary, group.contrary
        total += float(np.log((right * ratio + wrong) / (right + wrong * ratio)))
        odds |= known
    return float(np.tanh(0.5 * total)), max(odds, key=lambda name: odds[name] * np.sign(total))


def _log_odds(sign: Sign, value: float, error: float) -> float:
    """Log-odds of the first end by one sign: two normal distributions."""
    return 2.0 * sign.mean * value / (sign.deviation**2 + error**2)


def head_signs(
    points: Floats, radius: Floats, contrast: Floats, rate_hz: float, *, fixed: bool
) -> dict[str, tuple[float, float]]:
    """Return the value of each known sign, and its standard error within the film.

    Args:
        points: (T, P, 2) pixels, the same end first in all; NaN for a frame without a body.
        radius: (T, P) half the thickness.
        contrast: (F, P) of some frames against the ground on both sides.
        rate_hz: frames a second.
        fixed: whether the camera stands still.

    """
    good = np.isfinite(points[:, 0, 0])
    signs: dict[str, tuple[float, float]] = {}
    if fixed:
        step = max(1, round(_TRAVEL_S * rate_hz))
        score, usual_px = travel_score(points, step)
        if usual_px > 0.0:
            signs["travel"] = score, _JITTER_PX / usual_px
    if good.sum() >= _WAVE_FRAMES:
        wave = measure_wave(track_from_points("", points, rate_hz))
        signs["wave"] = 1.0 - 2.0 * wave.headward, 0.0
    signs["taper"] = difference(radius[good], _FRONT)
    signs["width"] = difference(radius[good], _TIP)
    if len(contrast):
        signs["eyes"] = difference(contrast, _EYES)
    return signs


def difference(values: Floats, part: slice) -> tuple[float, float]:
    """Return how much more the first end has of values (T, P) than the other, and its error."""
    first, last = (np.nanmean(order[:, part], axis=1) for order in (values, values[:, ::-1]))
    each = (first - last) / max(float(np.nanmean(np.abs(values))), 1e-9)
    each = each[np.isfinite(each)]
    if not len(each):
        return 0.0, 0.0
    mean = float(np.clip(each.mean(), -1.0, 1.0))
    value = float(np.copysign(max(abs(mean) - _EVEN, 0.0), mean))
    return value, float(each.std() / np.sqrt(len(each)))


def contrast_along(skeletons: Sequence[Skeleton], store: FrameStore) -> Floats:
    """(F, 101) contrast of some bodies against the ground on both sides, all channels."""
    used = [k for k, skeleton in enumerate(skeletons) if skeleton.status.has_points]
    rows = []
    for k in used[:: max(1, -(-len(used) // _PICTURES))]:
        cut_out = store.get(k)
        if cut_out is not None:
            sides = np.ma.masked_invalid(body_profile(skeletons[k], cut_out).sides)
            rows.append(np.linalg.norm(sides.mean(axis=0).filled(0.0), axis=1))
    return np.array(rows)


def travel_score(points_px: Floats, step: int) -> tuple[float, float]:
    """Whether the first end leads, -1 to 1: travel along the body's direction over all travel.

    Args:
        points_px: (T, P, 2), NaN where the body was not found.
        step: frames over which travel is measured; long enough that noise of a frame is small.

    Returns:
        Score, 0 where the body travels by less than a hundredth of its length in a step. The
        second value is the median travel of its middle in a step, px; 0 if it is unknown.

    """
    ahead = points_px[:, 0] - points_px[:, -1]
    unit = ahead / np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    middle = points_px.mean(axis=1)
    moved = middle[step:] - middle[:-step]
    along = (moved * unit[:-step]).sum(axis=1)
    distance = np.hypot(*moved.T)
    length_px = np.hypot(*np.diff(points_px, axis=1).transpose(2, 0, 1)).sum(axis=1)
    use = np.isfinite(along) & (distance > 0.01 * np.nanmedian(length_px))
    usual_px = float(np.nanmedian(distance)) if np.isfinite(distance).any() else 0.0
    return float(along[use].sum() / distance[use].sum()) if use.any() else 0.0, usual_px
