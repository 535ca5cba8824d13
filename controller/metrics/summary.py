"""The numbers of a run, as they go into ``summary.json``."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.metrics.effort import (
    costs_of_transport,
    energy_track,
)
from snakewalk.controller.metrics.ground_contact import lifted_by_current
from snakewalk.controller.metrics.ground_slope import carrier_share
from snakewalk.controller.metrics.path_error import (
    length_m,
    path_error_m,
    travelled_m,
    waypoint_times_s,
)
from snakewalk.controller.metrics.timing import skipped_cycles, wire_use
from snakewalk.controller.metrics.tracking import lag_s, tracking_errors
from snakewalk.controller.metrics.travel import Travel, travel
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.evidence import Kind
from snakewalk.controller.runlog.record import Header, RunRecord

_KEYS = {"paths_replanned": "paths_laid_again"}
"""Names of summary values that ``summary.json`` spells otherwise: programs read its keys."""


@dataclass(frozen=True, slots=True)
class SummarizedBattery:
    """Supply and load of a run; all but the voltages are estimated."""

    first_v: float | None
    last_v: float | None
    least_v: float | None
    current_max_a: float | None
    charge_ah: float | None
    winding_max_c: float | None


@dataclass(frozen=True, slots=True)
class SummarizedFriction:
    """Friction under the body: the values of the world file, and those that the run estimated."""

    along_file: float
    across_file: float
    along: float
    across: float
    along_95: tuple[float, float]
    """Interval of 95 %."""
    across_95: tuple[float, float]


@dataclass(frozen=True, slots=True)
class RunSummary:
    """A run in numbers, SI units, six digits; None for values that the log lacks."""

    run: str
    motion: str
    """Motion of the run; ``gait NAME`` for a gait."""
    robot: str
    world: str
    backend: str
    """Backend of the run: ``sim``, or the serial port."""
    software: str
    config_hash: str
    """Digest of run, robot and world."""
    seed: int
    log_complete: bool
    """Whether the log was closed properly."""
    log_note: str
    """Parts that the log lacks; empty if it is complete."""
    outcome: str
    """End of the run, in words."""
    waypoints: int
    waypoints_reached: int | None
    """Waypoints that the centre of mass came to, in order; None where the pose is dead-reckoned,
    as for every distance, speed and cost below: ``dead_reckoned_*`` has their counterparts."""
    waypoints_counted: int | None
    """Waypoints that the run itself counted."""
    waypoint_times_s: tuple[float, ...] | None
    """Times from torque on at which the waypoints were reached."""
    duration_s: float | None
    """Time from torque on to torque off."""
    path_length_m: float | None
    paths_replanned: int
    """Number of times that the path was replanned."""
    travelled_m: float | None
    """Length of the track of the centre of mass, on a way to waypoints while the shape moves."""
    path_error_mean_m: float | None
    path_error_max_m: float | None
    speed_m_s: float | None
    """Speed of the centre of mass, along the path or along the axis of the gait
    (``controller.metrics.travel``)."""
    predicted_speed_m_s: float | None
    """Forward speed of the links along themselves, while the pulse moves; compare with ``eta``."""
    planned_speed_m_s: float | None
    pulse_m_s: float | None
    """Mean speed at which the shape travels along the body."""
    eta: float | None
    """Gain: mean forward speed of the links along themselves over pulse speed, while it moves."""
    eta_predicted: float | None
    peak_current_a: float | None
    peak_torque_n_m: float | None
    """Peak current times the torque constant."""
    electrical_energy_j: float | None
    """Consumed by the motors in the whole run; returned energy is lost, electronics not
    included."""
    mechanical_energy_j: float | None
    """Net work at the shafts."""
    energy_source: str
    """Source of the energy: ``integrated`` in every physics step; ``sampled`` from readings and
    goals of the cycles."""
    electrical_cost_of_transport: float | None
    """Energy over weight times the distance of ``speed_m_s``, in the same time."""
    mechanical_cost_of_transport: float | None
    peak_joint_speed_rad_s: float | None
    peak_temperature_c: float | None
    lowest_voltage_v: float | None
    tracking_rms_rad: float | None
    tracking_max_rad: float | None
    lag_s: float | None
    """Delay of the measured behind the sent angles."""
    failed_reads: int
    """Joint states that a cycle failed to read."""
    yield_max_rad: float | None
    """Largest angle by which compliance moved a goal; None if nothing yields."""
    lifted_by_current: float | None
    """Mean share of lifted links, from the currents of the pitch joints."""
    clamps: int
    vetoes: int
    trip: str | None
    """Why safety stopped the run; None if it did not."""
    alarms: int
    cycles: int
    missed_deadlines: int
    lateness_max_s: float | None
    stalls: int
    """Cycles whose read the computer interrupted by a pause; not counted in older logs."""
    stalled_s: float | None
    """Total time of these pauses beyond the deadlines of the reads."""
    wire_use_mean: float | None
    """Share of the cycle that bytes were on the wire."""
    wire_use_max: float | None
    decisions: int
    """Decisions of the walk over the state library."""
    states_visited: int
    decisions_without_candidates: int
    carrier_share: float | None
    """Share of the decisions that ride on a wide wave, for steep ground; None if unknown."""
    state_library: dict[str, int]
    """Counts of recorded, random and refused states."""
    friction_found: SummarizedFriction | None
    """Last result of the run; None if it did not estimate it."""
    battery: SummarizedBattery | None
    """Supply and load over the run; None in older logs."""
    pose_evidence: str
    """Evidence of the poses: ``measured``, ``estimated`` or ``dead-reckoned``."""
    pose_source: str
    """Source of the poses: ``simulator``, ``camera``, ``joints``, ``imu``, or the name of a
    plug-in."""
    pose_position_sd_m: float | None
    """Standard deviation of the head's position; None where the source does not state it."""
    pose_heading_sd_rad: float | None
    """Standard deviation of the measured heading."""
    pose_is_simulated: bool
    """Whether the simulator measured the poses, or moved the body that was measured."""
    port_is_pseudo_terminal: bool | None
    """Whether simulated servos may have answered on the port; None without a port."""
    assumptions: dict[str, dict[str, object]]
    """Values that nothing measured, by name: ``value``, ``kind`` and ``source``."""
    dead_reckoned_waypoints_reached: int | None = None
    dead_reckoned_waypoints_counted: int | None = None
    dead_reckoned_waypoint_times_s: tuple[float, ...] | None = None
    dead_reckoned_travelled_m: float | None = None
    dead_reckoned_path_error_mean_m: float | None = None
    dead_reckoned_path_error_max_m: float | None = None
    dead_reckoned_speed_m_s: float | None = None
    dead_reckoned_eta: float | None = None
    dead_reckoned_electrical_cost_of_transport: float | None = None
    dead_reckoned_mechanical_cost_of_transport: float | None = None

    @property
    def evidence(self) -> dict[str, object]:
        """Kind, source and uncertainty of the pose, as results state them."""
        keys = ("pose_evidence", "pose_source", "pose_position_sd_m", "pose_heading_sd_rad")
        return {key: getattr(self, key) for key in keys}

    @property
    def is_measured(self) -> bool:
        """Whether distances and arrivals are measured."""
        return self.pose_evidence not in (Kind.DEAD_RECKONED, Kind.UNCONFIRMED)

    def to_dict(self) -> dict[str, Any]:
        """Keys and values of ``summary.json``."""
        return {_KEYS.get(key, key): value for key, value in asdict(self).items()}


_OF_THE_POSE = (
    "waypoints_reached",
    "waypoints_counted",
    "waypoint_times_s",
    "travelled_m",
    "path_error_mean_m",
    "path_error_max_m",
    "speed_m_s",
    "eta",
    "electrical_cost_of_transport",
    "mechanical_cost_of_transport",
)
"""Numbers that need a measured pose."""


def summary(record: RunRecord, moved: Travel | None = None) -> RunSummary:
    """Return the numbers of a run, from its log alone.

    ``moved`` is its travel, where it was computed before.

    Where the pose is dead-reckoned or unconfirmed, the numbers that need a measured pose are None
    and have a counterpart ``dead_reckoned_*``. Times count from the moment torque was switched on.
    """
    numbers = _summary(record, travel(record) if moved is None else moved)
    if numbers.is_measured:
        return numbers
    changes: dict[str, Any] = {
        f"dead_reckoned_{key}": getattr(numbers, key) for key in _OF_THE_POSE
    }
    changes |= dict.fromkeys(_OF_THE_POSE)
    return replace(numbers, **changes)


def _summary(record: RunRecord, moved: Travel) -> RunSummary:
    header = record.header
    cycle = record.cycle
    pose = record.pose
    walk = record.walk
    waypoints = len(header.plan.waypoints_m)
    times = waypoint_times_s(pose, header.plan)
    tripped = next((e.text for e in record.events if e.kind == "trip"), None)
    off_path = path_error_m(record)
    moving = pose.pulse_m_s > 0.0
    chosen = moving if moving.any() else np.ones(len(moving), dtype=bool)
    predicted = _mean(pose.predicted_speed_m_s[chosen])
    pulse = _mean(pose.pulse_m_s[moving])
    tracking = tracking_errors(cycle)
    squares, tracked, _ = tracking.sum(axis=0)
    current = _peak(largest(cycle.current_a))
    use = wire_use(record)
    energy = energy_track(record)
    energy_totals = energy.between(-np.inf, np.inf)
    along_links = _mean(pose.speed_m_s[chosen])
    costs = costs_of_transport(record, energy, moved)
    return RunSummary(
        run=header.run.name,
        motion=header.run.motion if header.run.gait is None else f"gait {header.run.gait.name}",
        robot=header.robot.name,
        world=header.world.name,
        backend=header.backend,
        software=header.software,
        config_hash=header.config_hash,
        seed=header.run.seed,
        log_complete=record.complete,
        log_note=record.note,
        outcome=_outcome(record, waypoints, len(times), tripped),
        waypoints=waypoints,
        waypoints_reached=len(times),
        waypoints_counted=int(pose.target.max(initial=0)),
        waypoint_times_s=tuple(float(f"{t - record.torque_on_s:.6g}") for t in times),
        duration_s=_digits(record.duration_s),
        path_length_m=_digits(length_m(header.plan.path_m)),
        paths_replanned=len(record.paths) - 1,
        travelled_m=_digits(_distance_m(record, moved)),
        path_error_mean_m=_digits(_mean(off_path)),
        path_error_max_m=_digits(_peak(off_path)),
        speed_m_s=_digits(moved.speed_m_s),
        predicted_speed_m_s=_digits(predicted),
        planned_speed_m_s=_digits(header.plan.predicted_speed_m_s),
        pulse_m_s=_digits(pulse),
        eta=_digits(along_links / pulse),
        eta_predicted=_digits(predicted / pulse),
        peak_current_a=_digits(current),
        peak_torque_n_m=_digits(current * header.torque_constant_n_m_a),
        electrical_energy_j=_digits(energy_totals[0]),
        mechanical_energy_j=_digits(energy_totals[1]),
        energy_source=energy.source,
        electrical_cost_of_transport=_digits(costs[0]),
        mechanical_cost_of_transport=_digits(costs[1]),
        peak_joint_speed_rad_s=_digits(_peak(largest(cycle.velocity_rad_s))),
        peak_temperature_c=_digits(_peak(record.slow.temperature_c)),
        lowest_voltage_v=_digits(-_peak(-record.slow.voltage_v)),
        tracking_rms_rad=_digits(float(np.sqrt(squares / tracked)) if tracked else np.nan),
        tracking_max_rad=_digits(_peak(tracking[tracking[:, 1] > 0, 2])),
        lag_s=_digits(lag_s(cycle, record.period_s)),
        failed_reads=int(np.count_nonzero(~cycle.valid)),
        yield_max_rad=_digits(_peak(largest(cycle.yield_rad))),
        lifted_by_current=_digits(lifted_by_current(record)),
        clamps=cycle.verdict.count("clamp"),
        vetoes=cycle.verdict.count("veto"),
        trip=tripped,
        alarms=sum(e.kind == "alarm" for e in record.events),
        cycles=len(cycle.time_s),
        missed_deadlines=int(skipped_cycles(record).sum()),
        lateness_max_s=_digits(_peak(cycle.lateness_s)),
        stalls=int(np.count_nonzero(np.diff(record.slow.stalled_s, prepend=0.0) > 0.0)),
        stalled_s=_digits(_peak(record.slow.stalled_s)),
        wire_use_mean=_digits(_mean(use)),
        wire_use_max=_digits(_peak(use)),
        decisions=len(walk.time_s),
        states_visited=int(walk.visited.max(initial=0)),
        decisions_without_candidates=int(np.count_nonzero(walk.candidates == 0)),
        carrier_share=_digits(carrier_share(record)),
        state_library=dict(header.plan.states or {}),
        friction_found=_friction(record),
        battery=_battery(record),
        **_evidence(record),
    )


def _evidence(record: RunRecord) -> dict[str, Any]:
    """Return the fields of a summary about pose, port and assumptions.

    The uncertainty is the one that the source states, or the one it measured: the largest of the
    position, which grows with the distance from the start, and the median of the heading.
    """
    header = record.header
    measured = record.pose_source
    stated = header.pose_evidence
    position_m = _digits(_peak(measured.position_sd_m[measured.is_confirmed > 0]))
    heading_rad = _median(measured.heading_sd_rad) if stated.is_measured else None
    return {
        "pose_evidence": str(stated.kind),
        "pose_source": stated.source,
        "pose_position_sd_m": (
            position_m if stated.is_measured and stated.position_m is None else stated.position_m
        ),
        "pose_heading_sd_rad": heading_rad if stated.heading_rad is None else stated.heading_rad,
        "pose_is_simulated": header.initial_pose is not None,
        "port_is_pseudo_terminal": header.port_is_pseudo_terminal,
        "assumptions": _assumptions(header),
    }


def _distance_m(record: RunRecord, moved: Travel) -> float:
    """Return the distance travelled; the start into the first shape is not part of a walk."""
    walks = len(record.header.plan.waypoints_m) > 0 and np.isfinite(moved.distance_m)
    return moved.distance_m if walks else travelled_m(record.pose)


def _assumptions(header: Header) -> dict[str, dict[str, object]]:
    """Return friction, mass and supply voltage, with the files that they are taken from."""
    robot = header.robot
    world = header.world
    values = {
        "friction_along": (world.friction.along, f"world {world.name}"),
        "friction_across": (world.friction.across, f"world {world.name}"),
        "friction_law": (
            world.friction.law_name,
            f"world {world.name}" if world.friction.law else f"default: {world.name} has no law",
        ),
        "mass_kg": (float(f"{robot.mass_kg:.6g}"), f"robot {robot.name}"),
        "supply_v": (robot.servo.supply_v, f"robot {robot.name}"),
    }
    return {
        key: {"value": value, "kind": str(Kind.ASSUMED), "source": source}
        for key, (value, source) in values.items()
    }


def _battery(record: RunRecord) -> SummarizedBattery | None:
    battery = record.battery
    if not len(battery.time_s):
        return None
    known_v = battery.voltage_v[np.isfinite(battery.voltage_v)]
    first_v, last_v, least_v = (
        (known_v[0], known_v[-1], known_v.min()) if len(known_v) else (np.nan,) * 3
    )
    return SummarizedBattery(
        _digits(float(first_v)),
        _digits(float(last_v)),
        _digits(float(least_v)),
        _digits(_peak(battery.current_a)),
        _digits(float(battery.charge_ah[-1])),
        _digits(_peak(battery.winding_c)),
    )


def _friction(record: RunRecord) -> SummarizedFriction | None:
    friction = record.friction
    file = record.header.world.friction
    if not len(friction.time_s) or friction.along[-1] == file.along:
        return None  # equal to its prior: no motion has shown anything

    def last(values: Floats) -> float:
        return float(f"{values[-1]:.3g}")

    return SummarizedFriction(
        file.along,
        file.across,
        last(friction.along),
        last(friction.across),
        (last(friction.along_95[:, 0]), last(friction.along_95[:, 1])),
        (last(friction.across_95[:, 0]), last(friction.across_95[:, 1])),
    )


def _outcome(record: RunRecord, waypoints: int, reached: int, tripped: str | None) -> str:
    if tripped is not None:
        return f"stopped by safety: {tripped}"
    if not record.header.pose_evidence.is_measured and waypoints:
        how = "dead reckoning"
        if record.header.pose_evidence.kind is Kind.UNCONFIRMED:
            how = "unconfirmed pose"
        so_far = f"believes it reached {reached} of {waypoints} ({how})"
    elif waypoints and reached == waypoints:
        return "every waypoint reached"
    else:
        so_far = f"{reached} of {waypoints} waypoints reached"
    if any(event.kind == "interrupt" for event in record.events):
        return f"interrupted: {so_far}" if waypoints else "interrupted"
    if waypoints:
        return so_far
    return "ran to its end" if record.complete else "the log breaks off"


def _mean(values: Floats) -> float:
    finite_values = values[np.isfinite(values)]
    return float(finite_values.mean()) if finite_values.size else float("nan")


def _median(values: Floats) -> float | None:
    finite_values = values[np.isfinite(values)]
    return _digits(float(np.median(finite_values))) if finite_values.size else None


def largest(by_joint: Floats) -> Floats:
    """Largest magnitude (T,) of the joints (T, J); NaN where none is known."""
    return np.asarray(by_rows(lambda rows: np.fmax.reduce(np.abs(rows), axis=1), by_joint))


def _peak(values: Floats) -> float:
    finite_values = values[np.isfinite(values)]
    return float(finite_values.max()) if finite_values.size else float("nan")


def _digits(value: float) -> float | None:
    return float(f"{value:.6g}") if np.isfinite(value) else None
