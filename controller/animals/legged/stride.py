"""The stride of a tracked animal: statistics of its joints over one cycle ([KP] 4.2.2).

``contact_fit`` finds contacts without a threshold on a foot's speed. A girdle's turn is the wave,
at the frequency of the feet, that the headings of the spine's segments share.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from snakewalk.config.animal import AnimalConfig
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.legged.contact_fit import (
    Contact,
    duty_of_cycle,
    fit_contacts,
    step,
)
from snakewalk.controller.animals.legged.prototype import spine_shares
from snakewalk.controller.animals.legged.views import View
from snakewalk.controller.gaits.footfall import lift
from snakewalk.controller.gaits.wave import TURN

FEWEST_CYCLES = 2.0
_FEWEST_FRAMES = 6
"""Fewest frames of a cycle."""
_MOST_CYCLES_PER_FRAME = 0.3
"""Highest frequency of the search, as a share of the frame rate."""


@dataclass(frozen=True, slots=True)
class Foot:
    """One foot over the cycle."""

    duty: float
    """Share of the cycle in which the foot is on the ground."""
    duty_sd: float
    """Spread of single cycles; NaN for fewer than three."""
    down: float
    """Time at which the foot comes down, in cycles after the front left foot."""
    step: float
    """Way over the trunk on the ground, body lengths."""
    ahead: float
    """Middle of a step, ahead of its girdle, body lengths."""
    side: float
    """Distance from the line of travel on the ground, body lengths; NaN from the side."""
    residual: float
    """RMS of the fit along the way, body lengths."""


@dataclass(frozen=True, slots=True)
class Stride:
    """One cycle of an animal, measured from its tracks."""

    cycle_s: float
    cycles: float
    """Number of cycles in the recording."""
    stride: float
    """Distance travelled in a cycle, body lengths."""
    length: float
    """Length of the spine, in the unit of the tracks."""
    at: tuple[float, float]
    """Places of the girdles along the spine: front, hind."""
    turn_rad: tuple[float, float]
    """Turn of the girdles, to either side; NaN from the side."""
    feet: tuple[Foot, Foot, Foot, Foot]
    """Motion of each foot, in the order of ``LEGS``."""
    phase: Floats
    """(T,) cycles since the front left foot first came down."""
    ahead: Floats
    """(T, 4) of the feet ahead of their girdles' mean places, body lengths; NaN where not seen."""
    shape: tuple[float, float]
    """Shape parameters p and q of the feet's motion in the air (``contact_fit``)."""
    lift: tuple[float, float]
    """Heights of a step of the front and the hind feet, body lengths; NaN from above."""

    def of(self, animal: AnimalConfig, name: str, source: str, length_m: float) -> AnimalConfig:
        """Return an animal with this motion; other figures come from ``animal``."""
        pairs = tuple(
            pair.model_copy(update=self._pair(k)) for k, pair in enumerate(animal.leg_pairs)
        )
        figures = {
            "name": name,
            "source": source,
            "length_m": round(length_m, 4),
            "stride": round(self.stride, 4),
            "cycle_s": round(self.cycle_s, 5),
            "leg_pairs": pairs,
        }
        return AnimalConfig.model_validate(animal.model_copy(update=figures).model_dump())

    def _pair(self, k: int) -> dict[str, float]:
        left, right = self.feet[2 * k], self.feet[2 * k + 1]
        measured = {
            "foot_side": 0.5 * (left.side + right.side),
            "turn_rad": self.turn_rad[k],
            "lift": self.lift[k],
        }
        return {name: round(value, 4) for name, value in measured.items() if np.isfinite(value)} | {
            "at": round(self.at[k], 4),
            "duty": round(float(np.clip(0.5 * (left.duty + right.duty), 0.11, 0.94)), 3),
            "left": round(left.down % 1.0, 3) % 1.0,
            "right": round(right.down % 1.0, 3) % 1.0,
            "foot_ahead": round(0.5 * (left.ahead + right.ahead), 4),
        }


def measure_stride(
    spine: Floats, feet: Floats, girdles: tuple[int, int], rate_hz: float, view: View
) -> Stride:
    """Measure the stride of an animal seen from above, or from its side on level ground.

    Args:
        spine: (T, P, 2) points, head first, to the right and upwards, in any unit.
        feet: (T, 4, 2) in the order of ``LEGS``; NaN where not seen, as in ``spine``.
        girdles: indices of the spine's points at the front and the hind legs.
        rate_hz: frames a second.
        view: above; or side, which shows heights of steps but no turns.

    Raises:
        InputError: fewer than two cycles, too few frames in one, or an animal that does not walk.

    """
    time_s = np.arange(len(spine)) / rate_hz
    spine = _bridged_points(spine, time_s)
    feet = np.asarray(feet, float)
    length = float(np.median(np.linalg.norm(np.diff(spine, axis=1), axis=-1).sum(axis=1)))
    spine = spine / length
    feet = feet / length
    mean = np.linalg.norm(np.diff(spine, axis=1), axis=-1).mean(axis=0)
    places = np.concatenate([[0.0], np.cumsum(mean)]) / mean.sum()
    from_side = view == "side"
    height = feet[..., 1].copy()
    if from_side:
        spine, feet = (np.where([True, False], points, 0.0 * points) for points in (spine, feet))
    front, hind = girdles
    girdle = spine[:, [front, front, hind, hind]]
    rough = _smoothed_points(spine[:, front] - spine[:, hind], max(3, len(spine) // 4))
    frequency_hz = _frequency_hz(_components(feet - girdle, _unit(rough)), rate_hz)
    cycles = time_s[-1] * frequency_hz
    if cycles < FEWEST_CYCLES:
        raise InputError(f"{cycles:.1f} cycles of the legs are seen; expected two or more")
    window = round(rate_hz / frequency_hz)
    if window < _FEWEST_FRAMES:
        raise InputError(f"{rate_hz / frequency_hz:.1f} frames a cycle; expected six or more")
    trunk = 0.5 * (spine[:, front] + spine[:, hind])
    middle = _smoothed_points(trunk, window)
    inner = slice(window // 2, len(spine) - window // 2)  # the mean over a cycle is whole there
    travelled = np.hypot(*np.diff(middle[inner], axis=0).T).sum()
    seconds = (len(middle[inner]) - 1) / rate_hz
    stride = float(travelled / seconds / frequency_hz)
    if stride < 0.05:
        raise InputError(f"{stride:.3f} body lengths a cycle: the animal does not walk")
    travel = _unit(_smoothed_points(np.gradient(middle, axis=0), 3))
    from_middle = feet - middle[:, None]
    # a foot on the ground is still: relative to the smoothed trunk it goes evenly
    ahead = _components(from_middle, travel) - np.nanmean(
        _components(girdle - middle[:, None], travel), axis=0
    )
    side = travel[:, None, 0] * from_middle[..., 1] - travel[:, None, 1] * from_middle[..., 0]
    side = np.full_like(side, np.nan) if from_side else side
    phase = time_s * frequency_hz
    fitted, shape = _fitted_contacts(phase, ahead, stride)
    first = fitted[0].down
    measured_feet = []
    for k, foot_fit in enumerate(fitted):
        on = (phase - foot_fit.down) % 1.0 < foot_fit.duty
        spread = _spread(phase, ahead[:, k], stride, foot_fit, shape)
        aside = float(np.abs(_median(side[on, k])))
        down = (foot_fit.down - first) % 1.0
        long = stride * foot_fit.duty
        measured_feet.append(
            Foot(foot_fit.duty, spread, down, long, foot_fit.ahead, aside, foot_fit.residual)
        )
    girdle_places = float(places[front]), float(places[hind])
    turned = (float("nan"), float("nan"))
    lifts = (float("nan"), float("nan"))
    if from_side:
        lifts = _lifts(fitted, phase, height)
    else:
        turned = _turns(spine, travel, phase, places, girdle_places)
    return Stride(
        1.0 / frequency_hz,
        float(cycles),
        stride,
        length,
        girdle_places,
        turned,
        (measured_feet[0], measured_feet[1], measured_feet[2], measured_feet[3]),
        phase - first,
        ahead,
        shape,
        lifts,
    )


def _fitted_contacts(
    phase: Floats, ahead: Floats, stride: float
) -> tuple[list[Contact], tuple[float, float]]:
    """Contacts of feet (T, 4), NaN where not seen, and the shape of their ways in the air."""
    is_visible = np.isfinite(ahead)
    counts = is_visible.sum(axis=0)
    if counts.min() < _FEWEST_FRAMES:
        raise InputError(f"--feet: their points are seen in {counts} frames; expected 6 or more")
    feet_indices = range(ahead.shape[1])
    return fit_contacts(
        [phase[is_visible[:, k]] for k in feet_indices],
        [ahead[is_visible[:, k], k] for k in feet_indices],
        stride,
    )


def _median(values: Floats) -> float:
    finite_values = values[np.isfinite(values)]
    return float(np.median(finite_values)) if len(finite_values) else float("nan")


def _lifts(fitted: list[Contact], phase: Floats, height: Floats) -> tuple[float, float]:
    """Heights of a step of the front and the hind feet, from heights (T, 4)."""
    lifts_m = []
    for k, foot_fit in enumerate(fitted):
        is_visible = np.isfinite(height[:, k])
        rise = lift((phase[is_visible] - foot_fit.down) % 1.0, foot_fit.duty)
        basis = np.stack([np.ones_like(rise), rise], axis=-1)
        lifts_m.append(float(np.linalg.lstsq(basis, height[is_visible, k], rcond=None)[0][1]))
    front = 0.5 * (lifts_m[0] + lifts_m[1])
    hind = 0.5 * (lifts_m[2] + lifts_m[3])
    return max(front, 0.0), max(hind, 0.0)


def model_ahead(stride: Stride, foot: int, phase: Floats) -> Floats:
    """Fitted way of a foot ahead of its girdle, body lengths, at cycles after the first foot."""
    foot_fit = stride.feet[foot]
    return foot_fit.ahead + step(
        (phase - foot_fit.down) % 1.0, stride.stride, foot_fit.duty, stride.shape
    )


def _bridged_points(points: Floats, time_s: Floats) -> Floats:
    """Points (T, P, 2); missing ones are interpolated in time."""
    filled = np.array(points, float)
    for k in range(filled.shape[1]):
        is_visible = np.isfinite(filled[:, k]).all(axis=1)
        if is_visible.sum() < 2:
            raise InputError(
                f"--spine: point {k + 1} is seen in {is_visible.sum()} frames; expected 2 or more"
            )
        for axis in range(2):
            filled[:, k, axis] = np.interp(time_s, time_s[is_visible], filled[is_visible, k, axis])
    return filled


def _frequency_hz(ahead: Floats, rate_hz: float) -> float:
    """Frequency of the feet: that of the wave that explains most of their ways."""
    is_visible = np.isfinite(ahead)
    time_s = np.arange(len(ahead)) / rate_hz

    def unexplained(frequency_hz: float) -> float:
        turn = TURN * frequency_hz * time_s
        basis = np.stack([np.ones_like(turn), time_s, np.cos(turn), np.sin(turn)], axis=-1)
        left = 0.0
        for k in range(4):
            on = is_visible[:, k]
            rest = (
                ahead[on, k] - basis[on] @ np.linalg.lstsq(basis[on], ahead[on, k], rcond=None)[0]
            )
            left += float(rest @ rest)
        return left

    low = 1.0 / time_s[-1]
    tried = np.arange(low, _MOST_CYCLES_PER_FRAME * rate_hz, 0.25 * low)
    if len(tried) == 0:
        raise InputError(f"{len(ahead)} frames are too few for a stride; give a longer film")
    costs = [unexplained(f) for f in tried]
    best = float(tried[int(np.argmin(costs))])
    bounds = max(best - 0.3 * low, 0.5 * low), best + 0.3 * low
    return float(minimize_scalar(unexplained, bounds=bounds, method="bounded").x)


def _spread(
    phase: Floats, ahead: Floats, stride: float, like: Contact, shape: tuple[float, float]
) -> float:
    """Standard deviation of the duty of single cycles, each from touch-down."""
    duties = []
    for cycle in range(int(np.ceil(phase[0] - like.down)), int(np.floor(phase[-1] - like.down))):
        is_cycle = (
            (phase - like.down >= cycle) & (phase - like.down < cycle + 1) & np.isfinite(ahead)
        )
        if is_cycle.sum() >= _FEWEST_FRAMES:
            duties.append(duty_of_cycle(phase[is_cycle], ahead[is_cycle], stride, like, shape))
    return float(np.std(duties, ddof=1)) if len(duties) > 2 else float("nan")


def _turns(
    spine: Floats, travel: Floats, phase: Floats, places: Floats, girdle_places: tuple[float, float]
) -> tuple[float, float]:
    """Turn of each girdle to either side, from the headings of the spine's segments."""
    step = spine[:, :-1] - spine[:, 1:]
    cross = travel[:, None, 0] * step[..., 1] - travel[:, None, 1] * step[..., 0]
    heading = np.arctan2(cross, _components(step, travel))
    wave = np.exp(-1j * TURN * phase)
    complete_cycles = phase - phase[0] < np.floor(phase[-1] - phase[0])
    amplitude = 2.0 * (heading[complete_cycles] * wave[complete_cycles, None]).mean(axis=0)
    # the tail swings more than the hind girdle moves it: its segments do not show the girdle
    ahead_of_tail = places[1:] <= girdle_places[1] + 1e-9
    shares = spine_shares(girdle_places, places)[ahead_of_tail]
    if len(shares) < 2:
        raise InputError("expected two segments of the spine or more ahead of the hind legs")
    solution = np.linalg.lstsq(shares.astype(complex), amplitude[ahead_of_tail], rcond=None)[0]
    return float(abs(solution[0])), float(abs(solution[1]))


def _smoothed_points(points: Floats, window: int) -> Floats:
    """Mean (T, 2) over a window of frames; the window is smaller at the ends."""
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(points, axis=0)])
    k = np.arange(len(points))
    half = np.minimum(np.minimum(k, len(points) - 1 - k), window // 2)
    return np.asarray((total[k + half + 1] - total[k - half]) / (2 * half + 1)[:, None])


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


def _components(vectors: Floats, direction: Floats) -> Floats:
    """Parts (T, K) of vectors (T, K, 2) along directions (T, 2)."""
    return np.asarray((vectors * direction[:, None]).sum(axis=-1))
