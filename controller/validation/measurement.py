"""Files of published measurements: source, body, ground, motion, and a row for each result."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from snakewalk.config.base import Name, Strict
from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked, load, load_robot, load_world, locate
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig

Kind = Literal["measured", "data sheet", "published model", "held out", "fitted"]
"""``held out``: constants come from other results of the same source, not from this one.
``fitted``: a constant of ours comes from this result."""
NEAR = (0.8, 1.25)
"""Ratios within a quarter; a row that leaves them states a cause (ours)."""


class WaveMotion(Strict):
    """Sinusoidal joint angles in a simulated run with servos on the bus."""

    kind: Literal["wave"] = Field("wave", description="kind of the motion")
    frequency_hz: float = Field(gt=0.0, le=10.0, description="frequency of all joints")
    amplitudes_deg: tuple[float, ...] = Field(description="amplitude of each joint, head first")
    phases_deg: tuple[float, ...] = Field(description="phase of each joint at the start")
    seconds: float = Field(10.0, gt=1.0, le=120.0, description="duration of the run")
    after_s: float = Field(
        2.0,
        ge=1.0,
        description="start of the evaluation; the amplitudes rise in the first second",
    )


class ShippedGait(Strict):
    """A shipped gait."""

    kind: Literal["gait"] = Field("gait", description="kind of the motion")
    name: str = Field(description="gait, or shipped set of its parameters")
    parameters: dict[str, float] = Field({}, description="parameters of the gait")
    frequency_hz: float = Field(gt=0.0, le=10.0, description="cycles per second in the run")
    seconds: float = Field(16.0, gt=1.0, le=120.0, description="duration of the run")
    after_s: float = Field(4.0, ge=1.0, description="start of the evaluation")


class PendulumMotion(Strict):
    """One servo that swings a weight, with a trajectory of BAM (Rhoban, bam/trajectory.py)."""

    kind: Literal["pendulum"] = Field("pendulum", description="kind of the motion")
    trajectory: Literal["sin_sin", "sin_time_square"] = Field(
        description="goals: sin t pi/2 + sin 5t sin 2t / 2, or sin t^2, for 6 s"
    )
    mass_kg: float = Field(gt=0.0, le=10.0, description="weight at the end of the arm")
    arm_m: float = Field(gt=0.0, le=1.0, description="length of the arm")
    p_gain: int = Field(gt=0, description="Position P Gain")
    rate_hz: float = Field(100.0, gt=1.0, description="goals per second")
    delay_s: float = Field(0.0, ge=0.0, le=0.1, description="time until a goal has an effect")


class MotorMotion(Strict):
    """Test of a servo at full output, with a free and with a blocked shaft."""

    kind: Literal["motor"] = Field("motor", description="kind of the motion")
    supply_v: float = Field(gt=0.0, le=60.0, description="supply of the servo")


Motion = Annotated[
    WaveMotion | ShippedGait | PendulumMotion | MotorMotion,
    Field(discriminator="kind", description="a table [motion]"),
]
Quantity = Literal[
    "head_speed_m_s",
    "tail_speed_m_s",
    "speed_m_s",
    "lengths_per_cycle",
    "lag_s",
    "rms_error_rad",
    "no_load_rpm",
    "stall_torque_n_m",
    "stall_current_a",
]


class MeasuredRow(Strict):
    """One published result, and the range that its ratio (simulated / measured) stays in."""

    name: Name
    quantity: Quantity = Field(description="compared quantity, with its unit")
    value: float = Field(gt=0.0, description="the published result")
    sd: float | None = Field(None, ge=0.0, description="its standard deviation")
    over: str | None = Field(
        None, description="name of another row: value and result are divided by that row's"
    )
    kind: Kind = Field(
        description="evidence: measured, data sheet, published model, held out, fitted"
    )
    range: tuple[float, float] = Field(description="lowest and highest ratio without a failure")
    cause: str = Field(
        "", description="most likely cause of a ratio outside 0.8 to 1.25, or a key of [causes]"
    )
    set: dict[str, Any] = Field({}, description="replaced keys: robot.…, world.… or motion.…")

    @model_validator(mode="after")
    def _range_is_explained(self) -> Self:
        low, high = self.range
        if not 0.0 <= low < high:
            raise ValueError(f"range: [{low:g}, {high:g}] is not in order; write lowest first")
        if not (NEAR[0] <= low and high <= NEAR[1]) and not self.cause:
            raise ValueError("cause: is required, because the range exceeds 0.8 to 1.25")
        return self


class PublishedResults(Strict):
    """A file of results from one source."""

    title: str = Field(min_length=3, description="body, ground and motion in a few words")
    source: str = Field(min_length=10, description="citation: author, title or repository, commit")
    licence: str = Field(min_length=2, description="licence of the data, or that none is stated")
    method: str = Field(min_length=10, description="how the source measured")
    uncertainty: str = Field(min_length=2, description="uncertainty of the results")
    assumed: tuple[str, ...] = Field((), description="values that the source does not state")
    causes: dict[str, str] = Field({}, description="causes that several rows name by their key")
    robot: str | dict[str, Any] = Field(description="a shipped robot, or a table [robot]")
    world: str | dict[str, Any] = Field("flat", description="a shipped world, or a table [world]")
    motion: Motion
    rows: tuple[MeasuredRow, ...] = Field(min_length=1, description="tables [[rows]]")

    @model_validator(mode="after")
    def _rows_refer_to_rows(self) -> Self:
        names = [row.name for row in self.rows]
        if len(set(names)) < len(names):
            raise ValueError("rows: two rows have the same name; names must differ")
        for row in self.rows:
            if row.over is not None and row.over not in names:
                raise ValueError(f"rows: {row.name}: over = {row.over}: is not a row of this file")
        return self

    def row(self, name: str) -> MeasuredRow:
        """Return a row by its name."""
        return next(row for row in self.rows if row.name == name)

    def cause(self, row: MeasuredRow) -> str:
        """Return the most likely cause of a row's ratio in words."""
        return self.causes.get(row.cause, row.cause)

    def conditions(self, row: MeasuredRow, place: str) -> "Conditions":
        """Return body, ground and motion of a row.

        Raises:
            ConfigError: every fault of the tables and of the replaced keys.
            InputError: a replaced key begins with another word than robot, world or motion.

        """
        tables: dict[str, dict[str, Any]] = {
            "robot": _table(self.robot, load_robot),
            "world": _table(self.world, load_world),
            "motion": self.motion.model_dump(),
        }
        for key, value in row.set.items():
            first, *path = key.split(".")
            if first not in tables or not path:
                raise InputError(
                    f"{place}: {row.name}: set: {key}; a key begins with robot., world. or motion."
                )
            _replace(tables[first], path, value)
        origin = f"{place}: {row.name}"
        return Conditions(
            robot=checked(RobotConfig, tables["robot"], origin),
            world=checked(WorldConfig, tables["world"], origin),
            motion=checked(_OneMotion, {"motion": tables["motion"]}, origin).motion,
        )


class _OneMotion(Strict):
    motion: Motion


class Conditions(Strict):
    """Body, ground and motion of one simulation."""

    robot: RobotConfig = Field(description="body")
    world: WorldConfig = Field(description="ground or water")
    motion: Motion

    @property
    def travels(self) -> bool:
        """Whether a body moves over the ground or through water."""
        return isinstance(self.motion, WaveMotion | ShippedGait)


def _table(given: str | dict[str, Any], read: Any) -> dict[str, Any]:
    return dict(read(given).model_dump()) if isinstance(given, str) else _copied_table(given)


def _copied_table(table: Mapping[str, Any]) -> dict[str, Any]:
    return {k: _copied_table(v) if isinstance(v, dict) else v for k, v in table.items()}


def _replace(table: dict[str, Any], path: list[str], value: object) -> None:
    *tables, last = path
    for name in tables:
        table = table.setdefault(name, {})
    table[last] = value


def load_measurement(name: str) -> tuple[str, PublishedResults]:
    """Return the name and the content of a shipped file, or of a TOML file.

    Raises:
        ConfigError: every fault of the file.

    """
    path = locate("measurements", name)
    return path.stem, load(path, PublishedResults)


def is_near(ratio: float) -> bool:
    """Whether a ratio is within a quarter."""
    return math.isfinite(ratio) and NEAR[0] <= ratio <= NEAR[1]
