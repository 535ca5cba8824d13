"""The library of shapes: recorded and random states that this robot can make and that push."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.shape.states import energy_kept, random_states, to_angles, to_states

ShapeFilter = Callable[[Floats], Bools]
"""Shapes (S, N) to a mask (S,) of those that cannot be used."""
_ROUNDS = 50


@dataclass(frozen=True, slots=True)
class StateLibrary:
    """Shapes that passed every filter, and how many did not."""

    shapes_rad: Floats
    """(S, N) tangent angles, head first, zero mean."""
    recorded: int
    """The first so many come from the recording, the rest are random."""
    rejected: dict[str, int]
    """Random and recorded states refused, by the first reason."""
    energy_kept: float
    """Share of the recorded shapes' energy that the coefficients hold, mean over the frames."""

    @property
    def counts(self) -> dict[str, int]:
        """For the log and the report."""
        refused = {f"rejected: {reason}": n for reason, n in self.rejected.items()}
        made = {"recorded": self.recorded, "random": len(self.shapes_rad) - self.recorded}
        return made | refused


def build_library(
    track_rad: Floats,
    filters: dict[str, ShapeFilter],
    *,
    coefficients: int,
    random_count: int,
    curvature: float,
    rng: np.random.Generator,
) -> StateLibrary:
    """Turn tangent angles (T, N) into states, add ``random_count`` random ones, filter all.

    Raises:
        InputError: too few random states pass: the robot cannot make these motions.

    """
    states = curvature * to_states(track_rad, coefficients)
    rejected = dict.fromkeys(filters, 0)
    recorded = _passing(to_angles(states, track_rad.shape[-1]), filters, rejected)
    made: list[Floats] = []
    for _ in range(_ROUNDS):
        missing = random_count - sum(map(len, made))
        if missing <= 0:
            break
        drawn = to_angles(random_states(states, max(missing, 20), rng), track_rad.shape[-1])
        made.append(_passing(drawn, filters, rejected)[:missing])
    fresh = np.concatenate([np.empty((0, track_rad.shape[-1])), *made])
    if len(fresh) < random_count or len(recorded) + len(fresh) < 2:
        reasons = ", ".join(f"{name}: {count}" for name, count in rejected.items())
        raise InputError(
            f"states: only {len(fresh)} of {random_count} random states can be used by this robot "
            f"(refused for {reasons}); raise behaviour.curvature if it is traction, lower it if it "
            "is anything else, or take another track"
        )
    kept = float(energy_kept(track_rad, coefficients).mean())
    return StateLibrary(np.concatenate([recorded, fresh]), len(recorded), rejected, kept)


def _passing(shapes: Floats, filters: dict[str, ShapeFilter], rejected: dict[str, int]) -> Floats:
    for name, refuses in filters.items():
        if len(shapes) == 0:
            break
        bad = refuses(shapes)
        rejected[name] += int(bad.sum())
        shapes = shapes[~bad]
    return shapes
