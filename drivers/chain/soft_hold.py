"""Soft hold: the joints hold their positions with a low Goal Current(102)."""

from collections.abc import Mapping

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.chain.liveness import RegisterCheck
from snakewalk.drivers.errors import BusError

_GOAL_CURRENT = "Goal Current"
_TRIES = 3
"""Writes of the currents until all servos confirm them (ours)."""


def limit_currents(
    bus: ChainBus,
    robot: RobotConfig,
    units: JointUnits,
    configured: Mapping[int, Mapping[str, int]],
    current_a: Floats,
) -> dict[int, Mapping[str, int]]:
    """Lower Goal Current of all joints to ``current_a`` (J,), and read it back.

    A joint with a lower limit keeps it.

    Returns:
        ``configured`` with the new currents.

    Raises:
        BusError: a servo has no current-based position control, or does not confirm its current.
        PortError: the port is gone.

    """
    raw: dict[int, int] = {}
    for joint in range(robot.joint_count):
        limit_raw = configured.get(joint, {}).get(_GOAL_CURRENT)
        if limit_raw is None:
            raise BusError(
                f"{robot.joint_label(joint)}: has no Goal Current that could hold it; set "
                'safety.on_trip = "off"'
            )
        raw[joint] = min(limit_raw, max(1, units.current_raw(joint, float(current_a[joint]))))
    check = RegisterCheck.of(bus, robot, _GOAL_CURRENT, raw, fast=False)
    differing = dict(raw)
    for _ in range(_TRIES):
        for value in sorted({*raw.values()}):
            ids = [robot.servo_ids[joint] for joint, raw_value in raw.items() if raw_value == value]
            bus.sync_write(ids, _GOAL_CURRENT, value)
        differing, is_complete = check.compare()
        if not differing and is_complete:
            return {joint: {**configured[joint], _GOAL_CURRENT: raw[joint]} for joint in raw}
    names = ", ".join(map(robot.joint_label, differing)) or "a servo"
    raise BusError(f"{names}: does not confirm the current that holds it")
