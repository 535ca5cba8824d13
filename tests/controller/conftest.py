"""A plausible run without physics: a serpenoid that follows a rounded square, with some mishaps."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.config.run import RunConfig
from snakewalk.controller.runlog.evidence import SIMULATED
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import Header, PlanSummary, RunRecord
from snakewalk.controller.runlog.topics import PoseTable, WalkTable
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.drivers.types import JointState

Make = Callable[..., Path]

SIDE_M, CORNER_M = 2.0, 0.2
LAG_S, ETA, PULSE_M_S = 0.06, 0.75, 0.30
WAVE_RAD, WAVES = 0.7, 1.2
DELAY_S = 1.5  # the start ramp


def heading_rad(s: np.ndarray) -> np.ndarray:
    """Heading of a square with round corners, unwrapped, at arc length ``s`` (before 0: east)."""
    straight, bend = SIDE_M - 2 * CORNER_M, 0.5 * np.pi * CORNER_M
    knots, angles, at = [0.0, SIDE_M - CORNER_M], [0.0, 0.0], SIDE_M - CORNER_M
    for k in range(1, 5):
        at += bend
        knots, angles = [*knots, at], [*angles, 0.5 * np.pi * k]
        at += straight
        knots, angles = [*knots, at], [*angles, 0.5 * np.pi * k]
    return np.interp(s, knots, angles)


def line(angles: np.ndarray, step: float) -> np.ndarray:
    """Points (n, 2) of a curve with tangent ``angles``, starting at the origin."""
    return np.cumsum(np.stack([np.cos(angles), np.sin(angles)], axis=1) * step, axis=0)


def ground_of(kind: str) -> HeightField | None:
    if kind == "flat":
        return None
    y, x = np.mgrid[-1.5:3.5:101j, -1.5:3.5:101j]
    z = 0.10 * np.sin(1.7 * x + 0.4) * np.cos(1.3 * y) + 0.05 * np.sin(4.1 * x - 2.0 * y)
    return HeightField(z - z.min(), 0.05, -1.5, -1.5)


def make_log(
    path: Path, *, seconds: float = 30.0, ground: str = "flat", trip: bool = False, seed: int = 0
) -> Path:
    """Write the log of a synthetic run; the shape moves at ``PULSE_M_S`` after ``DELAY_S``."""
    rng = np.random.default_rng(seed)
    run: RunConfig = load_run("flat-square").model_copy(update={"seed": seed})
    robot, world = load_robot("yaw16"), load_world("flat")
    joints, links = robot.joint_count, robot.joint_count + 1
    step = 0.005
    way = np.arange(-1.6, 14.0, step)
    shrink = 0.8812  # mean of cos(0.7 sin): how much of the wavy line is advance
    wave = WAVE_RAD * np.sin(2 * np.pi * WAVES * way / robot.length_m)
    curve = line(heading_rad(way * shrink) + wave, step)
    start = np.searchsorted(way, 0.0)
    wavelength = round(robot.length_m / WAVES / step)
    curve -= [curve[start, 0], curve[start : start + wavelength, 1].mean()]
    s = np.arange(0.0, 8.5, 0.05)
    planned = line(heading_rad(s), 0.05)
    behind = (np.arange(links) + 0.5) * robot.mean_link_length_m

    def body(time_s: float) -> tuple[np.ndarray, np.ndarray, float]:
        head = ETA * PULSE_M_S * max(time_s - DELAY_S, 0.0) / shrink
        at = head - behind
        points = np.stack([np.interp(at, way, c) for c in curve.T], axis=1)
        angle = heading_rad(at * shrink) + np.interp(at, way, wave)
        return points, -np.diff(angle), head * shrink

    target, clamped = 0, 0
    waypoints = np.array(run.waypoints_m)
    plan = PlanSummary(
        path_m=planned,
        waypoints_m=waypoints,
        waypoint_radius_m=run.waypoint_radius_m,
        predicted_speed_m_s=0.8 * PULSE_M_S,
        states={"recorded": 43, "random": 157, "refused": 61},
    )
    with RunLog(path) as log:
        log.config(
            Header(
                run,
                robot,
                world,
                backend="sim",
                plan=plan,
                ground=ground_of(ground),
                torque_constant_n_m_a=1.78,
                pose_evidence=SIMULATED,
            )
        )
        log.event(0.0, "start", "torque on; ramp of 1.2 s to the shape")
        visited: set[int] = set()
        late = 0
        for k in range(round(seconds * run.cycle_hz)):
            t = k / run.cycle_hz
            if 9.0 < t < 9.07:
                continue  # a stall: deadlines missed
            points, asked, along = body(t)
            measured = body(t - LAG_S)[1]
            speed = (measured - body(t - LAG_S - 0.02)[1]) / 0.02
            sent = asked.copy()
            verdict, who = "pass", ()
            if 14.0 < t < 14.6:
                sent[5], verdict, who = sent[5] - 0.05, "clamp", (5,)
                clamped += 1
            if trip and t > seconds - 0.5:
                sent, verdict, who = measured, "veto", (7,)
            valid = rng.random(joints) > 0.002
            heat = np.round(31.0 + 9.0 * (1 - np.exp(-t / 20.0)) + 2.0 * np.sin(np.arange(joints)))
            late = 0.0001 * rng.gamma(2.0)
            state = JointState(
                t,
                np.round(measured / 0.001534) * 0.001534,
                np.round(speed / 0.024) * 0.024,
                np.round((0.12 + 0.25 * np.abs(speed) + 0.02 * rng.random(joints)) / 0.00269)
                * 0.00269,
                heat,
                np.round(12.0 - 0.3 * np.abs(speed).mean(), 1) * np.ones(joints),
                np.zeros(joints, dtype=np.uint8),
                np.zeros(joints, dtype=np.uint8),
                np.where(valid, 0.0, 0.02),
                valid,
                np.zeros(joints),
            )
            log.cycle(
                t,
                asked,
                sent,
                state,
                deadline_s=t,
                lateness_s=late,
                wire_busy_s=0.0046 + (0.0 if valid.all() else 0.004),
                verdict=verdict,
                reason="" if verdict == "pass" else "goal rate",
                joints=who,
            )
            centre = points.mean(axis=0)
            if target < len(waypoints) and np.hypot(*(waypoints[target] - centre)) <= 0.3:
                target += 1
                log.event(t, "waypoint", f"waypoint {target} reached")
            going = t >= DELAY_S
            log.add(
                PoseTable,
                t,
                head_m=[*points[0], 0.03],
                rotation=np.eye(3),
                links_m=np.column_stack([points, np.full(links, 0.03)]),
                centre_m=[*centre, 0.03],
                speed_m_s=ETA * PULSE_M_S * (1 + 0.05 * np.sin(4 * t)) if going else 0.0,
                predicted_speed_m_s=0.8 * PULSE_M_S if going else 0.0,
                pulse_m_s=PULSE_M_S if going else 0.0,
                path_s_m=max(along - 0.5 * robot.length_m * shrink, 0.0),
                target=target,
            )
            if going and k % 80 == 0:
                near = int(rng.integers(0, 200))
                choice = near if rng.random() < 0.6 else int(rng.choice([*visited, near]))
                visited.add(choice)
                error = float(rng.normal(0.0, 0.35))
                log.add(
                    WalkTable,
                    t,
                    state=choice,
                    visited=len(visited),
                    heading_error_rad=error,
                    ramp_rad=float(np.clip(-error, -0.8, 0.8)),
                    candidates=int(rng.integers(0, 30)),
                    eta_q=0.6 + 0.3 * rng.random(),
                )
        if not trip:
            log.event(20.0, "alarm", "the body makes 41% of its predicted way", level="warning")
        else:
            log.event(seconds, "trip", "joint 7: current 2.4 A for 0.5 s", level="error")
        log.event(seconds, "stop", f"torque off; {target} waypoints reached")
    return path


@pytest.fixture(scope="session")
def make() -> Make:
    return make_log


@pytest.fixture(scope="session")
def record(tmp_path_factory: pytest.TempPathFactory) -> RunRecord:
    return read_log(make_log(tmp_path_factory.mktemp("run") / "run.mcap"))


@pytest.fixture
def legible_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each figure that a test writes has labelled axes, and text that is whole and large enough."""
    figure = pytest.importorskip("matplotlib.figure").Figure
    from tests.helpers.legible_figures import figure_faults

    save = figure.savefig

    def saved(drawn: Any, *args: Any, **options: Any) -> None:
        save(drawn, *args, **options)
        assert figure_faults(drawn) == []

    monkeypatch.setattr(figure, "savefig", saved)
