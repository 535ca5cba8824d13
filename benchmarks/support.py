"""How well the currents of the pitch joints tell which links bear: against the physics' own loads.

A gait's goals on servos that hold them; every 20 ms the currents, in the units of the register, and
mean contact forces of the same 20 ms. Deterministic: each row is one run of 8 s.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.rows import Row
from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.metrics.ground_contact import lifted, support_n
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad

TITLE = "Support told by current, against contact forces"

PERIOD_S, SECONDS, HZ, PARTS = 0.02, 8.0, 0.5, 4
CASES = (
    ("sidewinding", "flat"),
    ("sidewinding", "random-10"),
    ("sidewinding", "random-20"),
    ("lateral-undulation", "random-10"),
    ("lateral-undulation", "random-20"),
)


@dataclass(frozen=True)
class Told:
    """Estimated against true support over a run."""

    correlation: float
    """Of the forces on single links."""
    lifted_true: float
    """Share of links that bear less than a tenth of their weight."""
    lifted_told: float
    agree: float
    """Share of links that are rightly told to be lifted, or to bear."""


def run() -> list[Row]:
    """Measure."""
    rows = []
    for gait, world in CASES:
        told = measured(gait, world)
        rows.append(Row(f"{gait}, {world}: correlation", told.correlation, ""))
        rows.append(Row("  links lifted", 100.0 * told.lifted_true, "%"))
        rows.append(Row("  told to be lifted", 100.0 * told.lifted_told, "%"))
        rows.append(Row("  told rightly", 100.0 * told.agree, "%"))
    return rows


def measured(gait_name: str, world_name: str, seconds: float = SECONDS) -> Told:
    robot, world = load_robot("alternating16"), load_world(world_name)
    gait, motor = make_gait(gait_name), MOTORS[robot.servo.model]
    plant = MujocoPlant(robot, world, build_ground(world))
    drive = make_drive([motor] * robot.joint_count, robot.servo.supply_v)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = p_gain_per_rad(robot.servo.position_p_gain, motor)
    plant.reset((0.0, 0.0), 0.0, gait.joints_rad(robot, np.zeros(1))[0])
    found_n, true_n = [], []
    for k in range(round(seconds / PERIOD_S)):
        phase = np.array([2.0 * np.pi * HZ * k * PERIOD_S])
        drive.goal_rad[:] = gait.joints_rad(robot, phase)[0]
        loads = np.zeros(robot.joint_count + 1)
        for part in range(1, PARTS + 1):
            plant.advance((k + part / PARTS) * PERIOD_S, drive)
            loads += plant.mechanics.load_n / PARTS
        current_a = np.rint(drive.current_a / motor.current_unit_a) * motor.current_unit_a
        body = body_in_world(robot, plant.head_pose(), plant.position_rad.copy())
        found_n.append(support_n(robot, body, motor.torque_constant_n_m_a * current_a))
        true_n.append(loads)
    found, true = np.array(found_n[50:]), np.array(true_n[50:])
    told, real = lifted(robot, found), lifted(robot, true)
    return Told(
        float(np.corrcoef(found.ravel(), true.ravel())[0, 1]),
        float(real.mean()),
        float(told.mean()),
        float((told == real).mean()),
    )
