"""How far a step of the physics is off, on hills: one wave, the same joint goals, many steps.

The body of ``alternating16`` makes a serpenoid wave for 12 s, with no feedback, where the shipped
runs start. What is shown is how far its middle then is from where it is at an eighth of a
millisecond, over the way that it went there, after 4 s and 12 s: on rough ground a small error
grows. Deterministic: each row is one run.
"""

import numpy as np

from benchmarks.rows import Row
from snakewalk.config.arrays import Floats
from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.config.robot import BellyConfig
from snakewalk.config.run import RunConfig
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad

TITLE = "Steps of the physics on hills: a fixed wave, against 0.125 ms"

MARKS_S = (4.0, 12.0)
PERIOD_S = 0.02
HZ, AMPLITUDE_RAD, WAVELENGTH_JOINTS = 0.3, 0.6, 14.0
FINEST_S = 0.000125
STEPS_S = (0.004, 0.002, 0.001, 0.0005, 0.00025)
RUNS = ("jacksboro-traverse", "random-10", "ramp-10-along")


def run() -> list[Row]:
    """Measure."""
    rows = []
    for name in RUNS:
        finest = ways_m(name, FINEST_S)
        lengths_m = np.linalg.norm(finest, axis=1)
        for mark_s, length_m in zip(MARKS_S, lengths_m, strict=True):
            rows.append(Row(f"{name}: way in {mark_s:g} s", float(length_m), "m"))
        for step_s in STEPS_S:
            off = np.linalg.norm(ways_m(name, step_s) - finest, axis=1) / lengths_m
            for mark_s, share in zip(MARKS_S, off, strict=True):
                what = f"  {step_s * 1e3:g} ms, off after {mark_s:g} s"
                rows.append(Row(what, 100.0 * float(share), "%"))
    return rows


def ways_m(name: str, step_s: float) -> Floats:
    """Way of the body's middle (marks, 3) from the start to each mark."""
    body, drive = waving(load_run(name), step_s=step_s)
    start = body.link_positions_m.mean(axis=0)
    ways = []
    for k in range(1, round(MARKS_S[-1] / PERIOD_S) + 1):
        drive.goal_rad[:] = wave(k * PERIOD_S, len(drive.goal_rad))
        body.advance(k * PERIOD_S, drive)
        if k in {round(mark_s / PERIOD_S) for mark_s in MARKS_S}:
            ways.append(body.link_positions_m.mean(axis=0) - start)
    return np.array(ways)


def waving(
    given: RunConfig, belly: BellyConfig | None = None, step_s: float | None = None
) -> tuple[MujocoPlant, ServoDrive]:
    """``alternating16`` where a run starts, in the wave's first shape, and its servos."""
    robot, world = load_robot("alternating16"), load_world(given.world)
    if belly is not None:
        robot = robot.model_copy(update={"belly": belly})
    body = MujocoPlant(robot, world, build_ground(world), step_s)
    motor = MOTORS[robot.servo.model]
    drive = make_drive([motor] * robot.joint_count, robot.servo.supply_v)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = p_gain_per_rad(robot.servo.position_p_gain, motor)
    pitch = list(robot.pitch_joints)
    drive.p_gain_per_rad[pitch] = p_gain_per_rad(robot.servo.pitch_p_gain, motor)
    drive.current_limit_a[pitch] = robot.servo.pitch_current_limit_a
    heading_rad = np.arctan2(*(np.subtract(given.waypoints_m[0], given.start_m)[::-1]))
    body.reset(given.start_m, float(heading_rad), wave(0.0, robot.joint_count))
    return body, drive


def wave(time_s: float, joints: int) -> Floats:
    """(J,) goals: the yaw joints, every second one, bend; the others are level."""
    j = np.arange(joints)
    bend = AMPLITUDE_RAD * np.sin(2.0 * np.pi * (HZ * time_s - j / WAVELENGTH_JOINTS))
    return np.where(j % 2 == 0, bend, 0.0)
