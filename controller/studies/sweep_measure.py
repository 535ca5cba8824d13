"""One point of a sweep on the physics, with bus, safety layer and simulated servos."""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.controller.console.rounding import significant
from snakewalk.controller.metrics.displacement import gait_displacement
from snakewalk.controller.metrics.effort import effort
from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.metrics.travel import Travel
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.prepared_run import GroundedRun
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.studies.sweep_points import Point

P = TypeVar("P", bound=GroundedRun)


@dataclass(frozen=True, slots=True)
class Measurement:
    """Results of a point, in five digits; None if unknown. The fields are columns of a table."""

    ended: str
    """End of the run: ``ran to its end``, the trip, or ``refused: ...``, without further values."""
    cycles: int | None = None
    ran_hz: float | None = None
    """Cycles a second that the joints could follow."""
    forward_bl_cycle: float | None = None
    left_bl_cycle: float | None = None
    turn_rad_cycle: float | None = None
    speed_m_s: float | None = None
    climb_m_s: float | None = None
    power_w: float | None = None
    cost_of_transport: float | None = None
    mechanical_cost: float | None = None
    slip: float | None = None
    peak_current_a: float | None = None
    peak_torque_n_m: float | None = None
    peak_temperature_c: float | None = None
    tracking_max_rad: float | None = None
    least_rate: float | None = None
    pose_evidence: str | None = None
    """Evidence of the poses from which speeds and costs follow."""
    pose_source: str | None = None
    backend: str | None = None
    """Simulator of the point: ``compiled``, or ``warp:DEVICE``."""


COMPILED = "compiled"
FRICTION_SPREAD = 0.15
SUPPLY_SPREAD = 0.05


def measure(point: Point, vary: int | None = None) -> Measurement:
    """Run a point and return its results.

    ``vary`` draws friction (up to 15 % off) and supply (5 %) by the point's seed.
    """
    try:
        prepared = prepared_point(point)
        if vary is not None:
            prepared = varied(prepared, np.random.default_rng(vary))
        result = run_robot(RunRequest(prepared, stoppable=False))
    except InputError as error:
        return Measurement(f"refused: {error.faults[0]}")
    return measurement(
        result.record,
        result.summary,
        result.travel,
        tripped=result.outcome.tripped,
        least_rate=result.outcome.least_rate,
        backend=COMPILED,
    )


def prepared_point(point: Point) -> GaitRun:
    """Return the run of a point.

    Raises:
        InputError: the robot cannot make it.

    """
    return prepare_gait(
        point.gait,
        robot=point.robot,
        world=point.world,
        parameters=dict(point.parameters),
        seconds=point.seconds,
        seed=point.seed,
        keys=dict(point.keys),
    )


def measurement(
    record: RunRecord,
    numbers: RunSummary,
    travelled: Travel,
    *,
    tripped: str | None,
    least_rate: float,
    backend: str,
) -> Measurement:
    """Return the results of a gait run from its log, summary and travel."""
    if not numbers.is_measured:
        return Measurement(f"refused: {numbers.pose_evidence} pose; a sweep needs a measured one")
    moved = travelled.gait or gait_displacement(record)
    cost = effort(record, travelled)
    values = {
        "ran_hz": moved.frequency_hz,
        "forward_bl_cycle": moved.forward_bl,
        "left_bl_cycle": moved.left_bl,
        "turn_rad_cycle": moved.turn_rad,
        "speed_m_s": moved.speed_m_s,
        "climb_m_s": cost.climb_m_s,
        "power_w": cost.power_w,
        "cost_of_transport": cost.cost_of_transport,
        "mechanical_cost": cost.mechanical_cost,
        "slip": cost.slip,
        "peak_current_a": numbers.peak_current_a,
        "peak_torque_n_m": numbers.peak_torque_n_m,
        "peak_temperature_c": numbers.peak_temperature_c,
        "tracking_max_rad": numbers.tracking_max_rad,
        "least_rate": least_rate,
    }
    return Measurement(
        ended=tripped or "ran to its end",
        cycles=moved.cycles,
        pose_evidence=numbers.pose_evidence,
        pose_source=numbers.pose_source,
        backend=backend,
        **{name: significant(value, 5) for name, value in values.items()},
    )


def varied(prepared: P, rng: np.random.Generator) -> P:
    """Return a run with another friction (up to 15 % off) and supply (5 %)."""
    world = prepared.world
    robot = prepared.robot
    friction_draw, volts = rng.uniform(-1.0, 1.0, 2)
    factor = 1.0 + FRICTION_SPREAD * friction_draw
    friction = world.friction.model_copy(
        update={
            "along": world.friction.along * factor,
            "across": world.friction.across * factor,
        }
    )
    supply = robot.servo.supply_v * (1.0 + SUPPLY_SPREAD * volts)
    servo = robot.servo.model_copy(update={"supply_v": supply})
    return replace(
        prepared,
        world=world.model_copy(update={"friction": friction}),
        robot=robot.model_copy(update={"servo": servo}),
    )
