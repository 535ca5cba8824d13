"""Rehearsals of runs in simulated time: a served robot with errors, a tracker, and a judgement."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.pose import TrackerConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.kinematics.links import SpineLinks
from snakewalk.controller.metrics.summary import RunSummary, summary
from snakewalk.controller.pose.external_pose import START_SD_DEG
from snakewalk.controller.pose.udp_feed import SimulatedDatagrams
from snakewalk.controller.rehearsal.judgement import clock_offset_s, judge
from snakewalk.controller.run.backend import Backend
from snakewalk.controller.run.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.run.external.served_robot import Place, ServedRobot, Serving, place_of
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.truth import Truth, read_truth
from snakewalk.controller.runtime.slip_monitor import SlipMonitor
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.types import BodyPose

_SMOOTHING_S = 0.5
"""Time constant of the smoothing of the forward speed, as in the loop."""


@dataclass(frozen=True, slots=True)
class MetricErrors:
    """Metrics that a run reports, and those of the truth; None where one is unknown."""

    distance_m: float | None
    true_distance_m: float | None
    cost_of_transport: float | None
    """Electrical."""
    true_cost_of_transport: float | None
    eta: float | None
    true_eta: float | None
    alarms: int
    """Slip alarms of the run."""
    true_alarms: int
    """Slip alarms that the same monitor raises on the true motion."""


def metric_errors(truth: Truth, record: RunRecord, numbers: RunSummary) -> MetricErrors | None:
    """Compare the metrics of a run with those of its truth; None without poses that date it.

    Args:
        truth: of the server.
        record: log of the run.
        numbers: its summary.

    """
    records = true_record(truth, record)
    if records is None:
        return None
    true_run, displacement_m = records
    true = summary(true_run)
    mass_kg = record.header.robot.mass_kg
    cost = true.electrical_cost_of_transport
    if not np.isfinite(truth.energy_j).all():
        cost = None
    elif cost is not None:
        cost *= mass_kg / (mass_kg + sum(truth.header.get("load_kg") or ()))
    return MetricErrors(
        numbers.travelled_m,
        true.travelled_m,
        numbers.electrical_cost_of_transport,
        cost,
        numbers.eta,
        true.eta,
        sum(
            event.kind == "alarm" and "predicted distance" in event.text for event in record.events
        ),
        slip_alarms(true_run, displacement_m),
    )


def true_record(truth: Truth, record: RunRecord) -> tuple[RunRecord, Floats] | None:
    """Return the record with the true poses and energy, and the displacement (P,) of the links.

    The energy is the one that the server integrated. The links follow from the true pose of the
    head and the measured joints. None without datagrams that contain the time of the server's
    clock.
    """
    offset_s = clock_offset_s(truth, record)
    pose = record.pose
    if offset_s is None or len(pose.time_s) < 2:
        return None
    at_s = np.clip(pose.time_s - offset_s, truth.time_s[0], truth.time_s[-1])
    head_m = np.column_stack([np.interp(at_s, truth.time_s, axis) for axis in truth.head_m.T])
    turns = Slerp(truth.time_s, Rotation.from_matrix(truth.rotation))(at_s).as_matrix()
    cycle = record.cycle
    energy = [
        np.interp(cycle.time_s - offset_s, truth.time_s, total_j) for total_j in truth.energy_j.T
    ]
    with_energy = replace(cycle, electrical_j=energy[0], mechanical_j=energy[1])
    return with_head_poses(replace(record, cycle=with_energy), head_m, turns)


def with_head_poses(
    record: RunRecord, head_m: Floats, rotation: Floats
) -> tuple[RunRecord, Floats]:
    """Return the record with other poses (P, 3), (P, 3, 3) of the head, as ``true_record``."""
    pose = record.pose
    cycle = record.cycle
    rows = np.clip(np.searchsorted(cycle.time_s, pose.time_s), 0, len(cycle.time_s) - 1)
    spine = SpineLinks.of(record.header.robot)
    views = [
        spine.in_world(BodyPose(0.0, head, turn), np.nan_to_num(joints))
        for head, turn, joints in zip(head_m, rotation, cycle.measured_rad[rows], strict=True)
    ]
    displacement_m = np.array(
        [0.0, *(now.unbiased_advance_since_m(before) for before, now in pairwise(views))]
    )
    hz = record.header.run.cycle_hz
    speed_m_s = np.empty(len(views))
    smooth = 0.0
    for k, step_m in enumerate(displacement_m):
        smooth += min(1.0 / (_SMOOTHING_S * hz), 1.0) * (step_m * hz - smooth)
        speed_m_s[k] = smooth
    other = replace(
        pose,
        head_m=head_m,
        rotation=rotation,
        links_m=np.array([view.link_m for view in views]),
        centre_m=np.array([view.centre_m for view in views]),
        speed_m_s=speed_m_s,
    )
    return replace(record, pose=other), displacement_m


def slip_alarms(record: RunRecord, displacement_m: Floats) -> int:
    """Return how many slip alarms the monitor of the loop raises on a motion."""
    pose = record.pose
    header = record.header
    moving = pose.pulse_m_s > 0.0
    if not moving.any():
        return 0
    gain = float(np.median(pose.predicted_speed_m_s[moving] / pose.pulse_m_s[moving]))
    monitor = SlipMonitor(header.robot.length_m, gain, header.run.safety.advance_fraction)
    steps_m = pose.pulse_m_s * record.period_s
    return sum(monitor.update(*step) for step in zip(steps_m, displacement_m, strict=True))


@dataclass(frozen=True, slots=True)
class SimulatedPort:
    """A served robot as a port of a request; a ``RehearsedPort``."""

    served: ServedRobot
    name: str = "rehearsal"

    def open(self, run: RunConfig, robot: RobotConfig) -> Backend:
        """Open the port: the client knows its bytes and its datagrams, and nothing else."""
        line = self.served.line
        chain = ServoChain(
            servo_bus(line, robot.models_by_id),
            robot.model_copy(update={"ports": ()}),
            watchdog_s=run.safety.watchdog_s,
            rate_hz=run.cycle_hz,
        )
        return Backend(
            self.name,
            chain,
            line.clock,
            None,
            None,
            lambda: line.busy_s,
            poses=SimulatedDatagrams(self.served.due),
        )


RUNS = (
    "jacksboro-traverse",
    "jacksboro-around",
    "random-10",
    "ramp-10-up",
    "steps-4cm",
    "flat-slalom",
)
"""Runs that are rehearsed by default."""
START_SD_M = 0.05
"""Standard deviation of the robot's place at the start (ours)."""
LATE_S = 0.04
"""Delay of the goals, in addition to ``Deviation.drawn`` (ours)."""


@dataclass(frozen=True, slots=True)
class RehearsalCase:
    """A run to rehearse."""

    run: str
    seed: int
    has_errors: bool
    """Whether the robot and its ground have all the errors."""
    tracker: TrackerConfig

    @property
    def key(self) -> tuple[str, int, bool, str]:
        """Identity in a file of results."""
        return self.run, self.seed, self.has_errors, self.tracker.model_dump_json()


def rehearse(case: RehearsalCase, changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Rehearse a run; returns the case and its judgement, ready for JSON.

    Args:
        case: to rehearse.
        changes: of the run, as ``prepare_job`` accepts them.

    """
    with TemporaryDirectory() as folder:
        return {**described(case), **_judged_case(case, changes or {}, Path(folder))}


def described(case: RehearsalCase) -> dict[str, Any]:
    """Return a case, ready for JSON."""
    return {**asdict(case), "tracker": case.tracker.model_dump()}


def case_of(row: dict[str, Any]) -> RehearsalCase:
    """Return the case of a row.

    Raises:
        KeyError, ValueError: the row contains no case.

    """
    tracker = TrackerConfig.model_validate(row["tracker"])
    return RehearsalCase(row["run"], row["seed"], row["has_errors"], tracker)


def generator(seed: int) -> np.random.Generator:
    """Return the generator of a rehearsal's start and errors, which are drawn in this order."""
    return np.random.default_rng([seed, 0x42])


def moved(start: Place, rng: np.random.Generator) -> Place:
    """Draw the true start pose of the robot, which the run does not know."""
    x_m, y_m = np.add(start.start_m, START_SD_M * rng.standard_normal(2)).tolist()
    turned_rad = np.radians(START_SD_DEG) * rng.standard_normal()
    return replace(
        start,
        start_m=(x_m, y_m),
        heading_rad=start.heading_rad + float(turned_rad),
    )


def _judged_case(case: RehearsalCase, changes: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    try:
        prepared = prepare_job(case.run, seed=case.seed, pose="udp:9870", **changes)
        rng = generator(case.seed)
        place = moved(place_of(prepared), rng)
        deviation = Deviation.drawn(prepared.robot, rng) if case.has_errors else NO_DEVIATION
        serving = Serving(case.tracker, deviation, LATE_S if case.has_errors else 0.0, case.seed)
        truth = folder / "truth.jsonl"
        with ServedRobot(prepared.robot, prepared.world, place, serving, truth) as served:
            port = SimulatedPort(served)
            result = run_robot(RunRequest(prepared, port=port, stoppable=False))
    except InputError as error:
        return {"error": error.faults[0]}
    numbers = result.summary
    judgement = judge(read_truth(truth), result.record, numbers)
    metrics = metric_errors(read_truth(truth), result.record, numbers)
    return {
        **judgement.facts(),
        "metrics": None if metrics is None else asdict(metrics),
        "friction": _friction_facts(result, deviation),
        "duration_s": round(result.outcome.duration_s, 2),
        "missed": result.outcome.missed,
        "position_sd_m": numbers.pose_position_sd_m,
        "latency_s": result.pose.facts().get("pose_latency_s"),
    }


def _friction_facts(result: RunResult, deviation: Deviation) -> dict[str, Any] | None:
    """Return the estimated friction next to the true one; None if it was not estimated."""
    friction_found = result.summary.friction_found
    if friction_found is None:
        return None
    true = {
        "true_along": round(friction_found.along_file * deviation.along, 4),
        "true_across": round(friction_found.across_file * deviation.across, 4),
    }
    (low, high), (least, most) = friction_found.along_95, friction_found.across_95
    is_inside = low <= true["true_along"] <= high and least <= true["true_across"] <= most
    return {
        **asdict(friction_found),
        **true,
        "true_law": deviation.law or result.record.header.world.friction.law_name,
        "is_inside": is_inside,
        "was_used": any(event.kind == "friction" for event in result.record.events),
    }
