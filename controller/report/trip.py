"""The trip of a run: time, joint, and the joint's values next to their limits."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.drivers.safety.limits import SafetyLimits


@dataclass(frozen=True, slots=True)
class LimitedValue:
    """A value of the tripped joint, and its limit."""

    name: str
    value: str
    limit: str
    is_exceeded: bool


@dataclass(frozen=True, slots=True)
class Trip:
    """The trip that ended a run."""

    time_s: float
    reason: str
    joint: int | None
    """Index from the head; None if the reason names no joint of the robot."""
    joint_label: str
    """Label of the joint; empty without a joint."""
    values: tuple[LimitedValue, ...]
    """Last known values of the joint; empty without a joint."""


def trip_of(record: RunRecord) -> Trip | None:
    """Return the trip of a record; None if safety did not stop the run."""
    event = next((trip_event for trip_event in record.events if trip_event.kind == "trip"), None)
    if event is None:
        return None
    robot = record.header.robot
    joint = _first_joint(event.text, robot)
    if joint is None:
        return Trip(event.time_s, event.text, None, "", ())
    values = _limited_values(record, joint)
    return Trip(event.time_s, event.text, joint, robot.joint_label(joint), values)


def _first_joint(reason: str, robot: RobotConfig) -> int | None:
    places = [reason.find(robot.joint_label(joint)) for joint in range(robot.joint_count)]
    named = [(place, joint) for joint, place in enumerate(places) if place >= 0]
    return min(named)[1] if named else None


def _limited_values(record: RunRecord, joint: int) -> tuple[LimitedValue, ...]:
    """Values of the last cycle in which the joint was read, and of its last slow reading."""
    cycle = record.cycle
    slow = record.slow
    limits = SafetyLimits.from_config(record.header.robot, record.header.run.safety)
    values: list[LimitedValue] = []
    read = np.flatnonzero(cycle.valid[:, joint])
    if len(read):
        last = read[-1]
        current_a = float(np.abs(cycle.current_a[last, joint]))
        angle_rad = float(cycle.measured_rad[last, joint])
        error_rad = abs(float(cycle.sent_rad[max(last - 1, 0), joint]) - angle_rad)
        most_rad = float(limits.limit_rad[joint]) + limits.limit_slack_rad
        away_rad = float(limits.following_limit_rad[joint])
        values += [
            _upper_limit("current", current_a, limits.current_limit_a, "A", limits.current_time_s),
            _upper_limit("angle from zero", abs(angle_rad), most_rad, "rad"),
            _upper_limit("distance from goal", error_rad, away_rad, "rad", limits.following_time_s),
        ]
    warm = slow.temperature_c[np.isfinite(slow.temperature_c[:, joint]), joint]
    if len(warm):
        values.append(
            _upper_limit("temperature", float(warm[-1]), limits.temperature_limit_c, "°C")
        )
    volts = slow.voltage_v[np.isfinite(slow.voltage_v[:, joint]), joint]
    if len(volts):
        supply_v, least_v, most_v = float(volts[-1]), limits.voltage_min_v, limits.voltage_max_v
        values.append(
            LimitedValue(
                "supply",
                f"{supply_v:.1f} V",
                f"{least_v:.4g} to {most_v:.4g} V",
                not least_v <= supply_v <= most_v,
            )
        )
    return tuple(values)


def _upper_limit(
    name: str, value: float, limit: float, unit: str, for_s: float | None = None
) -> LimitedValue:
    """A value with an upper limit that counts at once, or after ``for_s`` seconds."""
    lasting = "" if for_s is None else f" for {for_s:g} s"
    return LimitedValue(
        name, f"{value:.3g} {unit}", f"at most {limit:.3g} {unit}{lasting}", value > limit
    )
