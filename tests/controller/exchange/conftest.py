"""A short log of a body that is bent in yaw and pitch, thrown about in space."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.runlog.evidence import SIMULATED
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import Header, PlanSummary, RunRecord
from snakewalk.controller.runlog.topics import (
    BatteryTable,
    FrictionTable,
    PathTable,
    PoseSourceTable,
    PoseTable,
    QposTable,
    ShadowTable,
    WalkTable,
    WaypointTable,
)
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.drivers.types import BodyPose, ImuState, JointState

ROWS = 20


def an_attitude(row: int) -> ImuState | None:
    """Not there at first, silent from row 10 to 12, 2 ms old else."""
    if row < 3:
        return None
    measured = 10 if row in (11, 12) else row
    turn = Rotation.random(random_state=100 + measured).as_matrix()
    age_s = 0.002 + 0.02 * (row - measured)
    return ImuState(turn, np.array([0.1, -0.2, 0.01 * measured]), age_s, row == measured)


@pytest.fixture(scope="session")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("export") / "log.mcap"
    rng = np.random.default_rng(7)
    run, robot, world = load_run("flat-square"), load_robot("alternating16-imu"), load_world("flat")
    joints = robot.joint_count
    plan = PlanSummary(np.array([[0.0, 0.0], [2.0, 1.0]]), np.array([[2.0, 1.0]]), 0.3)
    ground = HeightField(rng.normal(0.0, 0.1, (4, 5)), 0.7, -1.0, -1.0)
    zeros = np.zeros(joints, dtype=np.uint8)
    with RunLog(path) as file:
        file.config(
            Header(
                run,
                robot,
                world,
                backend="sim",
                plan=plan,
                ground=ground,
                torque_constant_n_m_a=1.78,
                pose_evidence=SIMULATED,
            )
        )
        file.event(0.0, "start", 'torque on; "quoted", ünïcode')
        for k in range(ROWS):
            time_s = 0.02 * k
            angles = rng.uniform(-1.2, 1.2, joints)
            state = JointState(
                time_s,
                np.where(np.arange(joints) == 15, np.nan, angles),  # one joint is never read
                rng.normal(size=joints),
                rng.normal(size=joints),
                np.full(joints, 30.0 + k // 10),
                np.full(joints, 12.0),
                (np.arange(joints) == 3).astype(np.uint8) * 32 if k else zeros,
                zeros,
                np.zeros(joints),
                np.ones(joints, dtype=bool),
                np.zeros(joints),
                an_attitude(k),
            )
            file.cycle(
                *(time_s, angles, angles / 3.0, state),
                deadline_s=time_s,
                lateness_s=0.0,
                wire_busy_s=0.004,
                electrical_j=0.1 * k,
                mechanical_j=0.05 * k,
                yield_rad=angles / 9.0,
                verdict="clamp" if k == 3 else "pass",
                joints=(2, 4) if k == 3 else (),
            )
            turn = Rotation.random(random_state=k).as_matrix()
            head = rng.normal(size=3)
            angles[15] = 0.0
            body = body_in_world(robot, BodyPose(time_s, head, turn), angles)
            file.add(
                PoseTable,
                time_s,
                **dict.fromkeys(("speed_m_s", "predicted_speed_m_s", "pulse_m_s", "path_s_m"), 0.1),
                head_m=head,
                rotation=turn,
                links_m=body.link_m,
                centre_m=body.centre_m,
            )
            file.add(ShadowTable, time_s, position_rad=angles / 2.0, current_a=angles / 5.0)
        source = {"position_sd_m": 0.01, "heading_sd_rad": 0.02, "latency_s": 0.1}
        source |= {"age_s": 0.12, "arrival_s": 0.25}
        file.add(PoseSourceTable, 0.3, sequence=4, fault="jump by 0.50 m", **source)
        file.add(WaypointTable, 0.2, waypoints_m=[[2.0, 1.0], [0.0, 3.0]])
        file.add(PathTable, 0.2, points_m=[[0.0, 1.0, 0.5], [2.0, 2.0, 0.4]])
        walk = {"heading_error_rad": 0.2, "ramp_rad": -0.1, "eta_q": 0.7, "carrier_rad": 1.1}
        file.add(WalkTable, 0.3, state=5, visited=2, candidates=4, **walk)
        friction = {"along_95": (0.11, 0.15), "across_95": (0.5, 0.6)}
        file.add(FrictionTable, 0.3, along=0.13, across=0.56, **friction)
        windings = angles + 40.0
        load = {"voltage_v": 11.8, "current_a": 1.5, "charge_ah": 0.01, "winding_c": windings}
        file.add(BatteryTable, 0.3, **load)
        file.add(QposTable, 0.3, qpos=np.arange(7 + joints) / 7.0)
        file.event(0.38, "trip", "joint 7: current", level="error")
    return path


@pytest.fixture(scope="session")
def record(log: Path) -> RunRecord:
    return read_log(log)
