"""A small run that fills every topic, with awkward numbers in it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.controller.runlog.evidence import SIMULATED
from snakewalk.controller.runlog.record import Header, MotorEnergy, PlanSummary, Winding
from snakewalk.controller.runlog.topics import (
    BatteryTable,
    FrictionTable,
    PathTable,
    PoseTable,
    QposTable,
    WalkTable,
)
from snakewalk.controller.runlog.writer import ONE_PART, PartLimits, RunLog
from snakewalk.drivers.types import JointState

JOINTS = 16
Write = Callable[..., Path]


def joint_state(k: int) -> JointState:
    """State of cycle ``k``; joint 3 fails in every tenth cycle, slow values change each second."""
    t = 0.02 * k
    q = 0.7 * np.sin(3.0 * t - 0.4 * np.arange(JOINTS))
    age = np.zeros(JOINTS)
    valid = np.ones(JOINTS, dtype=bool)
    if k % 10 == 9:
        age[3], valid[3] = 0.02, False
    slow = np.full(JOINTS, np.nan) if k < 25 else np.full(JOINTS, 30.0 + k // 50)
    zeros = np.zeros(JOINTS, dtype=np.uint8)
    slow_age = np.where(np.isnan(slow), np.inf, 0.0)
    return JointState(
        t, q, 2.1 * q, 0.5 * np.abs(q), slow, slow / 2.5, zeros, zeros, age, valid, slow_age
    )


def write_log(path: Path, cycles: int, limits: PartLimits = ONE_PART) -> Path:
    """Log ``cycles`` cycles at 50 Hz."""
    run, robot, world = load_run("flat-square"), load_robot("yaw16"), load_world("flat")
    plan = PlanSummary(
        path_m=np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]]),
        waypoints_m=np.array(run.waypoints_m),
        waypoint_radius_m=run.waypoint_radius_m,
        states={"recorded": 40, "random": 160},
    )
    ground = HeightField(np.outer(np.arange(300), np.ones(200)) * 1e-3, 0.02, -2.0, -3.0)
    with RunLog(path, limits=limits) as log:
        log.config(
            Header(
                run,
                robot,
                world,
                backend="sim",
                plan=plan,
                ground=ground,
                winding=Winding(5.2, 2.5),
                pose_evidence=SIMULATED,
            )
        )
        log.event(0.0, "start", "torque on")
        for k in range(cycles):
            t = 0.02 * k
            asked = np.sin(np.arange(JOINTS) + t) / 3.0  # every digit of a float64 used
            log.cycle(
                t + 0.004,
                asked,
                np.clip(asked, -0.3, 0.3),
                joint_state(k),
                deadline_s=t,
                lateness_s=0.0,
                wire_busy_s=0.0046,
                **(MotorEnergy(0.1 * k, 0.02 * k) if k % 2 else MotorEnergy())._asdict(),
                verdict="clamp" if k % 7 == 0 else "pass",
                reason="rate" if k % 7 == 0 else "",
                joints=(1, 5) if k % 7 == 0 else (),
            )
            links = None if k % 2 else np.full((JOINTS + 1, 3), 0.1 * k)
            centre_m = [t, 0.0, 0.03]
            log.add(
                PoseTable, t, head_m=centre_m, rotation=np.eye(3), links_m=links, centre_m=centre_m
            )
            if k % 40 == 0:
                log.add(
                    WalkTable,
                    t,
                    state=k,
                    visited=k // 40,
                    heading_error_rad=0.1,
                    ramp_rad=-0.1,
                    candidates=3,
                )
                log.add(QposTable, t, qpos=np.arange(23) + 0.5)
        log.add(
            FrictionTable,
            1.0,
            along=0.13,
            across=0.56,
            along_95=(0.11, 0.15),
            across_95=(0.5, 0.6),
        )
        log.add(
            BatteryTable,
            1.0,
            voltage_v=11.8,
            current_a=1.5,
            charge_ah=0.01,
            winding_c=np.full(JOINTS, 41.0),
        )
        log.add(PathTable, 1.0, points_m=[[0.0, 1.0], [2.0, 2.0]])
    return path


@pytest.fixture(scope="session")
def write() -> Write:
    return write_log


@pytest.fixture(scope="session")
def state_of() -> Callable[[int], JointState]:
    return joint_state
