"""The stride of a tracked animal: statistics of its joints over one cycle ([KP] 4.2.2).

Every figure is that of a motion model fitted to the tracks. A foot's way over the trunk is that of
``footfall.swing``, so its contact is found without a threshold on its speed. A girdle's turn is the
wave, at the frequency of the feet, that the headings of the spine's segments share.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from snakewalk.config.animal import AnimalConfig
from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.legged.prototype import spine_shares
from snakewalk.controller.gaits.footfall import swing
from snakewalk.controller.gaits.wave import TURN

FEWEST_CYCLES = 2.0
_FEWEST_FRAMES = 6
"""Fewest frames of a cycle."""
_PLACES = 24
_MOST_HZ = 0.3
"""Share of the frame rate: the highest frequency of the search."""


@dataclass(frozen=True, slots=True)
class Foot:
    """One foot over the cycle."""

    duty: float
    """Share of the cycle on the ground."""
    duty_sd: float
    """Spread of single cycles; NaN for fewer than three."""
    down: float
    """When it comes down, in cycles after the front left foot."""
    step: float
    """Way over the trunk on the ground, body lengths."""
    ahead: float
    """Middle of a step, ahead of its girdle, body lengths."""
    side: float
    """Distance from the line of travel on the ground, body lengths."""
    residual: float
    """RMS of the fit along the way, body lengths."""


@dataclass(frozen=True, slots=True)
class Stride:
    """One cycle of an animal, measured from its tracks."""

    cycle_s: float
    cycles: float
    """How many were seen."""
    stride: float
    """Way of a cycle, body lengths."""
    length: float
    """Length of the spine, in the unit of the tracks."""
    at: tuple[float, float]
    """Places of the girdles along the spine: front, hind."""
    turn_rad: tuple[float, float]
    """Turn of the girdles, to either side."""
    feet: tuple[Foot, Foot, Foot, Foot]
    """In the order of ``LEGS``."""
    phase: Floats
    """(T,) cycles since the front left foot first came down."""
    ahead: Floats
    """(T, 4) of the feet ahead of their girdles, body lengths; NaN where not seen."""

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
        return {
            "at": round(self.at[k], 4),
            "duty": round(float(np.clip(0.5 * (left.duty + right.duty), 0.11, 0.94)), 3),
            "left": round(left.down % 1.0, 3) % 1.0,
            "right": round(right.down % 1.0, 3) % 1.0,
            "foot_side": round(0.5 * (left.side + right.side), 4),
            "foot_ahead": round(0.5 * (left.ahead + right.ahead), 4),
            "turn_rad": round(self.turn_rad[k], 4),
        }


def measure_stride(spine: Floats, feet: Floats, girdles: tuple[int, int], rate_hz: float) -> Stride:
    """Measure the stride of an animal seen from above.

    Args:
        spine: (T, P, 2) points along it in plan, head first, to the right and upwards, in any unit.
        feet: (T, 4, 2) in the order of ``LEGS``; NaN where one was not seen, as of the spine.
        girdles: indices of the spine's points at the front and the hind legs.
        rate_hz: frames a second.

    Raises:
        InputError: fewer than two cycles, too few frames in one, or an animal that does not walk.

    """
    time_s = np.arange(len(spine)) / rate_hz
    spine, feet = _bridged(spine, time_s), np.asarray(feet, float)
    length = float(np.median(np.linalg.norm(np.diff(spine, axis=1), axis=-1).sum(axis=1)))
    spine, feet = spine / length, feet / length
    front, hind = girdles
    girdle = spine[:, [front, front, hind, hind]]
    rough = _smoothed(spine[:, front] - spine[:, hind], max(3, len(spine) // 4))
    frequency_hz = _frequency_hz(_over(feet - girdle, _unit(rough)), rate_hz)
    cycles = time_s[-1] * frequency_hz
    if cycles < FEWEST_CYCLES:
        raise InputError(f"{cycles:.1f} cycles of the legs are seen; expected two or more")
    window = round(rate_hz / frequency_hz)
    if window < _FEWEST_FRAMES:
        raise InputError(f"{rate_hz / frequency_hz:.1f} frames a cycle; expected six or more")
    trunk = 0.5 * (spine[:, front] + spine[:, hind])
    middle = _smoothed(trunk, window)
    inner = slice(window // 2, len(spine) - window // 2)  # the mean over a cycle is whole there
    way = np.hypot(*np.diff(middle[inner], axis=0).T).sum()
    seconds = (len(middle[inner]) - 1) / rate_hz
    stride = float(way / seconds / frequency_hz)
    if stride < 0.05:
        raise InputError(f"{stride:.3f} body lengths a cycle: the animal does not walk")
    travel = _unit(_smoothed(np.gradient(middle, axis=0), 3))
    along, beside = feet - girdle, feet - middle[:, None]
    ahead = _over(along, travel)
    side = travel[:, None, 0] * beside[..., 1] - travel[:, None, 1] * beside[..., 0]
    phase = time_s * frequency_hz
    fitted = [_fit(phase, ahead[:, k], stride) for k in range(4)]
    first = fitted[0][1]
    found = []
    for k, (duty, down, offset, residual) in enumerate(fitted):
        on = ((phase - down) % 1.0 < duty) & np.isfinite(side[:, k])
        found.append(
            Foot(
                duty,
                _spread(phase, ahead[:, k], stride, down),
                (down - first) % 1.0,
                stride * duty,
                offset,
                float(np.abs(np.median(side[on, k]))),
                residual,
            )
        )
    mean = np.linalg.norm(np.diff(spine, axis=1), axis=-1).mean(axis=0)
    places = np.concatenate([[0.0], np.cumsum(mean)]) / mean.sum()
    at = float(places[front]), float(places[hind])
    turned = _turns(spine, travel, phase, places, at)
    return Stride(
        1.0 / frequency_hz, float(cycles), stride, length, at, turned,
        (found[0], found[1], found[2], found[3]), phase - first, ahead,
    )  # fmt: skip


def model_ahead(stride: Stride, foot: int, phase: Floats) -> Floats:
    """Fitted way of a foot ahead of its girdle, body lengths, at cycles after the first foot."""
    one = stride.feet[foot]
    return one.ahead + 0.5 * one.step * swing((phase - one.down) % 1.0, one.duty)


def _bridged(points: Floats, time_s: Floats) -> Floats:
    """Points (T, P, 2) with missing ones put between their neighbours in time."""
    filled = np.array(points, float)
    for k in range(filled.shape[1]):
        seen = np.isfinite(filled[:, k]).all(axis=1)
        if seen.sum() < 2:
            raise InputError(f"point {k + 1} of the spine is seen in {int(seen.sum())} frames")
        for axis in range(2):
            filled[:, k, axis] = np.interp(time_s, time_s[seen], filled[seen, k, axis])
    return filled


def _frequency_hz(ahead: Floats, rate_hz: float) -> float:
    """Frequency of the feet: that of a wave which explains most of all their ways."""
    seen = np.isfinite(ahead)
    time_s = np.arange(len(ahead)) / rate_hz

    def unexplained(frequency_hz: float) -> float:
        turn = TURN * frequency_hz * time_s
        basis = np.stack([np.ones_like(turn), time_s, np.cos(turn), np.sin(turn)], axis=-1)
        left = 0.0
        for k in range(4):
            on = seen[:, k]
            rest = (
                ahead[on, k] - basis[on] @ np.linalg.lstsq(basis[on], ahead[on, k], rcond=None)[0]
            )
            left += float(rest @ rest)
        return left

    low = 1.0 / time_s[-1]
    tried = np.arange(low, _MOST_HZ * rate_hz, 0.25 * low)
    if len(tried) == 0:
        raise InputError(f"{len(ahead)} frames are too few")
    costs = [unexplained(f) for f in tried]
    best = float(tried[int(np.argmin(costs))])
    bounds = max(best - 0.3 * low, 0.5 * low), best + 0.3 * low
    return float(minimize_scalar(unexplained, bounds=bounds, method="bounded").x)


def _fit(phase: Floats, ahead: Floats, stride: float) -> tuple[float, float, float, float]:
    """Duty, touch-down of the foot in cycles, middle of its step, RMS of the residual."""
    seen = np.isfinite(ahead)
    if seen.sum() < _FEWEST_FRAMES:
        raise InputError(f"a foot is seen in {int(seen.sum())} frames; expected six or more")
    at, way = phase[seen], ahead[seen]

    def left(duty: float, down: float) -> tuple[float, float]:
        model = 0.5 * stride * duty * swing((at - down) % 1.0, duty)
        offset = float(np.mean(way - model))
        return float(np.sqrt(np.mean((way - model - offset) ** 2))), offset

    grid = np.meshgrid(np.arange(0.2, 0.9, 0.05), np.arange(_PLACES) / _PLACES, indexing="ij")
    duties, downs = (values.reshape(-1, 1) for values in grid)
    off = way - 0.5 * stride * duties * swing((at - downs) % 1.0, duties)
    best = int(np.argmin(off.var(axis=1)))

    def cost(x: Any) -> float:  # scipy's stubs know no array of floats here
        return left(float(np.clip(x[0], 0.12, 0.93)), float(x[1]))[0]

    found = minimize(
        cost,
        np.array([duties[best, 0], downs[best, 0]]),
        method="Nelder-Mead",
        options={"xatol": 1e-5, "fatol": 1e-9},
    )
    duty, down = float(np.clip(found.x[0], 0.12, 0.93)), float(found.x[1]) % 1.0
    residual, offset = left(duty, down)
    return duty, down, offset, residual


def _spread(phase: Floats, ahead: Floats, stride: float, down: float) -> float:
    """Standard deviation of the duty of single cycles, each begun when the foot comes down."""
    each = []
    for cycle in range(int(np.ceil(phase[0] - down)), int(np.floor(phase[-1] - down))):
        one = (phase - down >= cycle) & (phase - down < cycle + 1) & np.isfinite(ahead)
        if one.sum() >= _FEWEST_FRAMES:
            each.append(_fit(phase[one], ahead[one], stride)[0])
    return float(np.std(each, ddof=1)) if len(each) > 2 else float("nan")


def _turns(
    spine: Floats, travel: Floats, phase: Floats, places: Floats, at: tuple[float, float]
) -> tuple[float, float]:
    """Turn of each girdle to either side, from the headings of the spine's segments."""
    step = spine[:, :-1] - spine[:, 1:]
    cross = travel[:, None, 0] * step[..., 1] - travel[:, None, 1] * step[..., 0]
    heading = np.arctan2(cross, _over(step, travel))
    wave = np.exp(-1j * TURN * phase)
    whole = _whole(phase)
    amplitude = 2.0 * (heading[whole] * wave[whole, None]).mean(axis=0)
    # the tail swings more than the hind girdle moves it: its segments do not show the girdle
    ahead_of_tail = places[1:] <= at[1] + 1e-9
    shares = spine_shares(at, places)[ahead_of_tail]
    if len(shares) < 2:
        raise InputError("expected two segments of the spine or more ahead of the hind legs")
    found = np.linalg.lstsq(shares.astype(complex), amplitude[ahead_of_tail], rcond=None)[0]
    return float(abs(found[0])), float(abs(found[1]))


def _whole(phase: Floats) -> Bools:
    """Frames of as many whole cycles as there are."""
    return np.asarray(phase - phase[0] < np.floor(phase[-1] - phase[0]))


def _smoothed(points: Floats, window: int) -> Floats:
    """Mean (T, 2) over a window of frames; at the ends over what there is, as far to both sides."""
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(points, axis=0)])
    k = np.arange(len(points))
    half = np.minimum(np.minimum(k, len(points) - 1 - k), window // 2)
    return np.asarray((total[k + half + 1] - total[k - half]) / (2 * half + 1)[:, None])


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


def _over(vectors: Floats, direction: Floats) -> Floats:
    """Parts (T, K) of vectors (T, K, 2) along directions (T, 2)."""
    return np.asarray((vectors * direction[:, None]).sum(axis=-1))
