"""All points of a sweep: gaits times robots, as far as they fit each other."""

from dataclasses import dataclass

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.app.studies.sweep_points import Point, points_of
from snakewalk.controller.gaits.registry import GAITS

ROBOTS = ("yaw16", "alternating16")


@dataclass(frozen=True, slots=True)
class Planned:
    """What will be run."""

    points: list[Point]
    left_out: list[str]
    """Gaits that a robot cannot make, and points that its joints do not allow."""


def plan_sweep(
    gaits: list[str] | None,
    robots: list[str] | None,
    count: int,
    *,
    seed: int,
    seconds: float,
) -> Planned:
    """Draw the points.

    Raises:
        InputError: unknown gaits or robots, or nothing that fits.

    """
    unknown = [name for name in gaits or () if name not in GAITS]
    if unknown:
        raise InputError(
            [f"{name}: no such gait; there are {', '.join(GAITS)}" for name in unknown]
        )
    bodies = [load_robot(name) for name in robots or ROBOTS]
    points: list[Point] = []
    left_out: list[str] = []
    for name in gaits or GAITS:
        for body in bodies:
            try:
                some, refused = points_of(GAITS[name], body, count, seed=seed, seconds=seconds)
            except InputError as error:
                left_out.append(error.faults[0])
                continue
            points += some
            if refused or len(some) < count:
                left_out.append(
                    f"{name} on {body.name}: {refused} draws that its joints do not allow"
                    + (f"; only {len(some)} points" if len(some) < count else "")
                )
    if not points:
        raise InputError(left_out)
    return Planned(points, left_out)
