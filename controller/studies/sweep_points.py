"""Points of a sweep: a Sobol sequence over the parameters of gaits."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from scipy.stats import qmc

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Gait, Range, ranges
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.run.kinds.gait_factory import gait_keys
from snakewalk.controller.run.run_keys import with_keys_of

SLOWEST_HZ = 0.2
_BLOCK = 10
"""Points that are drawn at a time, as a power of two."""
_TRIES = 64
"""Most draws per point: a robot may reject most of a range."""


@dataclass(frozen=True, slots=True)
class Point:
    """One gait with its parameters on one robot; number 0 has the defaults."""

    gait: str
    robot: str
    """Shipped name, or the path of a TOML file."""
    world: str
    number: int
    seed: int
    seconds: float
    parameters: dict[str, Any] = field(default_factory=dict)
    keys: tuple[tuple[str, Any], ...] = ()
    """Replaced values of run, robot and world, as in ``prepare_gait``."""

    @property
    def key(self) -> tuple[str, ...]:
        """Unique key in a table, as text."""
        place = (self.gait, self.robot, self.world)
        replaced = " ".join(f"{key}={value}" for key, value in self.keys)
        return (*place, replaced, str(self.number), str(self.seed), f"{self.seconds:g}")


@dataclass(frozen=True, slots=True)
class Space:
    """The parameters of a gait that can be varied, as a unit cube."""

    gait: type[Gait]
    spans: dict[str, Range]

    @classmethod
    def of(cls, gait: type[Gait]) -> "Space":
        """All numbers of the gait; a mirrored gait is not another one."""
        spans = {k: span for k, span in ranges(gait.model).items() if span.kind is not bool}
        return cls(gait, spans)

    def values(self, unit: Floats) -> dict[str, Any]:
        """Parameters of a point (d,) of the unit cube."""
        values_by_name: dict[str, Any] = {}
        for (name, span), u in zip(self.spans.items(), unit, strict=True):
            low = max(span.low, SLOWEST_HZ) if name == "frequency_hz" else span.low
            value = low + float(np.clip(u, 0.0, 1.0)) * (span.high - low)
            values_by_name[name] = round(value) if span.kind is int else float(f"{value:.4g}")
        return values_by_name

    def unit(self, values: dict[str, Any]) -> Floats:
        """Return the point (d,) of the unit cube where parameters have these values."""
        unit_values = []
        for name, span in self.spans.items():
            low = max(span.low, SLOWEST_HZ) if name == "frequency_hz" else span.low
            unit_values.append((float(values[name]) - low) / (span.high - low))
        return np.asarray(np.clip(np.array(unit_values), 0.0, 1.0))


def points_of(
    gait: type[Gait],
    robot: RobotConfig,
    count: int,
    *,
    seed: int,
    seconds: float,
    file: str | None = None,
    keys: Mapping[str, Any] | None = None,
) -> tuple[list[Point], int]:
    """Return up to ``count`` points that the joints allow, and the number of rejected ones.

    ``file`` is the file of a robot that is not shipped; a worker loads it with ``keys``, which
    ``robot`` already has.

    Raises:
        InputError: the robot lacks joints of the gait.

    """
    gait().check(robot)
    space = Space.of(gait)
    place = (gait.name, file or robot.name, gait.world)
    replaced = tuple((keys or {}).items())
    points = [Point(*place, 0, seed, seconds, keys=replaced)]
    refused = 0
    sobol = qmc.Sobol(
        len(space.spans), rng=np.random.default_rng([seed, crc32(gait.name.encode())])
    )
    for unit in _draws(sobol, int(np.ceil(np.log2(count * _TRIES)))):
        if len(points) >= count:
            break
        values = space.values(unit)
        try:
            gait.of(values).check(robot)
        except InputError:
            refused += 1
            continue
        number = len(points)
        points.append(Point(*place, number, seed, seconds, values, replaced))
    return points, refused


def _draws(sobol: qmc.Sobol, exponent: int) -> Iterator[Floats]:
    """Yield 2^exponent points (d,) of the sequence, drawn a block at a time."""
    block = min(exponent, _BLOCK)
    for _ in range(1 << exponent - block):
        yield from sobol.random(1 << block)


def robot_file(name_or_path: str) -> str | None:
    """Return the absolute path of a user's robot; None for a shipped one."""
    return str(Path(name_or_path).resolve()) if name_or_path.endswith(".toml") else None


ROBOTS = ("yaw16", "alternating16")


@dataclass(frozen=True, slots=True)
class Planned:
    """Points to run."""

    points: list[Point]
    left_out: list[str]
    """Gaits that a robot cannot make, and points outside its joints' ranges."""


def plan_sweep(
    gaits: list[str] | None,
    robots: list[str] | None,
    count: int,
    *,
    seed: int,
    seconds: float,
    keys: Mapping[str, Any] | None = None,
) -> Planned:
    """Draw the points, once per name; ``keys`` as in ``prepare_gait``.

    Raises:
        InputError: unknown gaits, robots or keys, or nothing that fits.

    """
    keys = gait_keys(keys)
    unknown = [name for name in gaits or () if name not in GAITS]
    if unknown:
        raise InputError(
            [f"{name}: no such gait; there are {', '.join(GAITS)}" for name in unknown]
        )
    bodies = [
        (with_keys_of("robot", load_robot(name), keys), robot_file(name))
        for name in dict.fromkeys(robots or ROBOTS)
    ]
    points: list[Point] = []
    left_out: list[str] = []
    for name in dict.fromkeys(gaits or GAITS):
        for body, file in bodies:
            try:
                with_keys_of("world", load_world(GAITS[name].world), keys)
                some, refused = points_of(
                    GAITS[name], body, count, seed=seed, seconds=seconds, file=file, keys=keys
                )
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
