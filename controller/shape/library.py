"""The library of shapes: recorded and random states that pass the robot's filters."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Bools, Complexes, Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.synthesis import WavesConfig
from snakewalk.controller.shape.states import (
    energy_kept,
    limit_to_waves,
    random_states,
    to_angles,
    to_states,
)

ShapeFilter = Callable[[Floats], Bools]
"""Shapes (S, N) to a mask (S,) of those that cannot be used."""
_ROUNDS = 50
_FACTORS = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0)
_DRAWN = 200
_LEAST_SHARE = 0.2


@dataclass(frozen=True, slots=True)
class StateLibrary:
    """Shapes that passed every filter, and the number of the others."""

    shapes_rad: Floats
    """(S, N) tangent angles, head first, zero mean."""
    recorded: int
    """Number of states from the recording, which come first; the rest are random."""
    rejected: dict[str, int]
    """Random and recorded states refused, by the first reason."""
    curvature: float
    """Factor on the bends of the recorded shapes."""
    energy_kept: float
    """Share of the recorded shapes' energy that the coefficients hold, mean over the frames."""
    frame: Ints
    """(recorded,) row of the recording of each state that comes from it."""

    @property
    def counts(self) -> dict[str, int]:
        """Return the counts for the log and the report."""
        refused = {f"rejected: {reason}": n for reason, n in self.rejected.items()}
        counts_by_kind = {"recorded": self.recorded, "random": len(self.shapes_rad) - self.recorded}
        return counts_by_kind | refused


def build_library(
    track_rad: Floats,
    filters: dict[str, ShapeFilter],
    *,
    coefficients: int,
    random_count: int,
    curvature: float | None,
    rng: np.random.Generator,
    waves: WavesConfig | None = None,
) -> StateLibrary:
    """Turn tangent angles (T, N) into states, add ``random_count`` random ones, filter all.

    ``curvature`` scales the bends. None selects the smallest of 1, 1.2, ... 2 at which a fifth of
    random states passes, or else the factor at which most pass. ``waves`` limits the random states
    to the given kinds of waves, in the given shares ([PT] 2.6.6).

    Raises:
        InputError: too few random states pass: the robot cannot make these motions.

    """
    points = track_rad.shape[-1]
    states = to_states(track_rad, coefficients)
    if curvature is None:
        curvature = _half_lengths_m(states, filters, points)
    states = curvature * states
    rejected = dict.fromkeys(filters, 0)
    recorded = np.empty((0, points))
    parts = [np.empty((0, points))]
    frame: Ints = np.empty(0, dtype=np.int64)
    for band_count, band in _counts(random_count, waves):
        drawn_count = 0
        for _ in range(_ROUNDS):
            if drawn_count >= band_count:
                break
            drawn = random_states(states, max(band_count - drawn_count, 20), rng)
            if waves is not None and band is not None:
                drawn = limit_to_waves(drawn, *band, waves.energy_share)
            passed = _passing(to_angles(drawn, points), filters, rejected)[0]
            parts.append(passed[: band_count - drawn_count])
            drawn_count += len(parts[-1])
        if band is None:
            recorded, frame = _passing(to_angles(states, points), filters, rejected)
    fresh = np.concatenate(parts)
    if len(fresh) < random_count or len(recorded) + len(fresh) < 2:
        reasons = ", ".join(f"{name}: {count}" for name, count in rejected.items())
        raise InputError(
            f"states: this robot can use only {len(fresh)} of {random_count} random states "
            f"(refused for {reasons}); raise behaviour.curvature for traction, lower it for any "
            "other reason, or use another track"
        )
    kept = float(energy_kept(track_rad, coefficients).mean())
    shapes_rad = np.concatenate([recorded, fresh])
    return StateLibrary(shapes_rad, len(recorded), rejected, curvature, kept, frame)


def _half_lengths_m(states: Complexes, filters: dict[str, ShapeFilter], points: int) -> float:
    """(L,) half the length of each link."""
    shares = []
    for factor in _FACTORS:
        drawn = random_states(factor * states, _DRAWN, np.random.default_rng(0))
        shares.append(len(_passing(to_angles(drawn, points), filters, {})[0]) / _DRAWN)
        if shares[-1] >= _LEAST_SHARE:
            return factor
    return _FACTORS[int(np.argmax(shares))]


def _counts(
    random_count: int, waves: WavesConfig | None
) -> list[tuple[int, tuple[int, int] | None]]:
    """Number of random states for each band of coefficients; None: as recorded."""
    parts = {} if waves is None else waves.parts
    if not parts:
        return [(random_count, None)]
    ends = np.rint(random_count * np.cumsum([0.0, *parts.values()])).astype(int)
    return list(zip(np.diff(ends).tolist(), parts, strict=True))


def _passing(
    shapes: Floats, filters: dict[str, ShapeFilter], rejected: dict[str, int]
) -> tuple[Floats, Ints]:
    """Return the shapes (P, N) that pass every filter, and their rows (P,); count the others."""
    row: Ints = np.arange(len(shapes))
    for name, refuses in filters.items():
        if len(row) == 0:
            break
        bad = refuses(shapes[row])
        rejected[name] = rejected.get(name, 0) + int(bad.sum())
        row = row[~bad]
    return shapes[row], row
