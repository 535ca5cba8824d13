"""The numbers of a run, as they go into ``summary.json``; None where the log cannot tell."""

from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.metrics.path import length_m, path_error_m, travelled_m, waypoint_times_s
from snakewalk.controller.metrics.timing import skipped_cycles, wire_use
from snakewalk.controller.metrics.tracking import lag_s, tracking_error_rad
from snakewalk.controller.runlog.record import RunRecord

Summary = dict[str, Any]


def summary(record: RunRecord) -> Summary:
    """Everything that counts, from the log alone."""
    parts = (_identity, _outcome, _way, _speed, _servos, _safety, _timing, _walk)
    return {key: value for part in parts for key, value in part(record).items()}


def trip(record: RunRecord) -> str | None:
    """Text of the first trip, if there was one."""
    return next((e.text for e in record.events if e.kind == "trip"), None)


def _identity(record: RunRecord) -> Summary:
    h = record.header
    return {
        "run": h.run.name,
        "motion": h.run.motion if h.run.gait is None else f"gait {h.run.gait.name}",
        "robot": h.robot.name,
        "world": h.world.name,
        "backend": h.backend,
        "software": h.software,
        "config_hash": h.config_hash,
        "seed": h.seed,
        "log_complete": record.complete,
        "log_note": record.note,
    }


def _outcome(record: RunRecord) -> Summary:
    times = waypoint_times_s(record.pose, record.header.plan)
    total, reached = len(record.header.plan.waypoints_m), len(times)
    tripped = trip(record)
    if tripped is not None:
        outcome = f"stopped by safety: {tripped}"
    elif total == 0:
        outcome = "ran to its end"
    elif reached == total:
        outcome = "every waypoint reached"
    else:
        outcome = f"{reached} of {total} waypoints reached"
    return {
        "outcome": outcome,
        "waypoints": total,
        "waypoints_reached": reached,
        "waypoints_counted": int(record.pose.target.max(initial=0)),
        "waypoint_times_s": [_digits(t) for t in times],
        "duration_s": _digits(record.end_s),
    }


def _way(record: RunRecord) -> Summary:
    error = path_error_m(record)
    return {
        "path_length_m": _digits(length_m(record.header.plan.path_m)),
        "paths_laid_again": len(record.paths) - 1,
        "travelled_m": _digits(travelled_m(record.pose)),
        "path_error_mean_m": _digits(_mean(error)),
        "path_error_max_m": _digits(_peak(error)),
    }


def _speed(record: RunRecord) -> Summary:
    pose = record.pose
    moving = pose.pulse_m_s > 0.0
    chosen = moving if moving.any() else np.ones(len(moving), dtype=bool)
    speed, predicted = _mean(pose.speed_m_s[chosen]), _mean(pose.predicted_speed_m_s[chosen])
    pulse = _mean(pose.pulse_m_s[moving])
    return {
        "speed_m_s": _digits(speed),
        "predicted_speed_m_s": _digits(predicted),
        "planned_speed_m_s": _digits(record.header.plan.predicted_speed_m_s),
        "pulse_m_s": _digits(pulse),
        "eta": _digits(speed / pulse),
        "eta_predicted": _digits(predicted / pulse),
    }


def _servos(record: RunRecord) -> Summary:
    cycle = record.cycle
    error = tracking_error_rad(cycle)
    current = _peak(np.abs(cycle.current_a))
    return {
        "peak_current_a": _digits(current),
        "peak_torque_n_m": _digits(current * record.header.torque_constant_n_m_a),
        "peak_joint_speed_rad_s": _digits(_peak(np.abs(cycle.velocity_rad_s))),
        "peak_temperature_c": _digits(_peak(record.slow.temperature_c)),
        "lowest_voltage_v": _digits(-_peak(-record.slow.voltage_v)),
        "tracking_rms_rad": _digits(float(np.sqrt(_mean(np.square(error))))),
        "tracking_max_rad": _digits(_peak(np.abs(error))),
        "lag_s": _digits(lag_s(cycle, record.period_s)),
        "failed_reads": int(np.count_nonzero(~cycle.valid)),
    }


def _safety(record: RunRecord) -> Summary:
    return {
        "clamps": record.cycle.verdict.count("clamp"),
        "vetoes": record.cycle.verdict.count("veto"),
        "trip": trip(record),
        "alarms": sum(e.kind == "alarm" for e in record.events),
    }


def _timing(record: RunRecord) -> Summary:
    use = wire_use(record)
    return {
        "cycles": len(record.cycle.time_s),
        "missed_deadlines": int(skipped_cycles(record).sum()),
        "lateness_max_s": _digits(_peak(record.cycle.lateness_s)),
        "wire_use_mean": _digits(_mean(use)),
        "wire_use_max": _digits(_peak(use)),
    }


def _walk(record: RunRecord) -> Summary:
    walk = record.walk
    return {
        "decisions": len(walk.time_s),
        "states_visited": int(walk.visited.max(initial=0)),
        "decisions_without_candidates": int(np.count_nonzero(walk.candidates == 0)),
        "state_library": dict(record.header.plan.states or {}),
    }


def _mean(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else float("nan")


def _peak(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else float("nan")


def _digits(value: float) -> float | None:
    return float(f"{value:.6g}") if np.isfinite(value) else None
