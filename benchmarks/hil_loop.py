"""The whole simulated loop against the physics alone.

The loop is that of ``snakewalk run``: 50 Hz, pilot and what finds the friction, safety, chain,
bytes both ways, simulated servos, friction, body. The physics alone is ``mj_step`` of the same
model at 2 ms, ten steps a call, begun in every cycle from the state and forces that the loop had
there. Start-up is left out.

All runs repeat bit for bit, so each cycle's cost is the least of all rounds, and what is shown is
the mean of all cycles: what other programs on the machine cost is left out, on both sides alike.
"""

import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks.rows import Row
from benchmarks.simulated_robot import (
    NoLog,
    Recorder,
    SimulatedRobot,
    State,
    Stopwatch,
    travelling_wave,
)
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.runlog.writer import RunLog

TITLE = "Simulated loop against bare mj_step: 16 servos, 50 Hz, 2 ms"

SECONDS = 15.0
"""Of simulated time in a round."""
ROUNDS = 20
LIMIT = 2.0

Floats = NDArray[np.float64]


def run() -> list[Row]:
    """Measure."""
    prepared = prepare_walk("flat-square", time_limit_s=SECONDS)
    robot = SimulatedRobot(prepared)
    steps = round(1.0 / (prepared.run.cycle_hz * robot.plant.step_s))
    recorder = Recorder(robot.plant.mechanics.data)
    robot.walk(NoLog(), recorder.on_progress)
    model = robot.plant.mechanics.model
    costs: tuple[list[Floats], ...] = [], [], [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(ROUNDS):
            wave, walk, logged = Stopwatch(), Stopwatch(), Stopwatch()
            SimulatedRobot(prepared).wave(SECONDS, wave.on_progress)
            SimulatedRobot(prepared).walk(NoLog(), walk.on_progress)
            with RunLog(Path(folder) / f"{turn}.mcap") as log:
                SimulatedRobot(prepared).walk(log, logged.on_progress)
            found = (
                bare_s(model, recorder.states, steps),
                body_s(prepared),
                *(w.cycle_s for w in (wave, walk, logged)),
            )
            for all_of_one, one in zip(costs, found, strict=True):
                all_of_one.append(one)
    bare, *others = (float(np.min(each, axis=0).mean()) for each in costs)
    names = (
        ("servo motors, friction, body", None),
        ("safety, bytes, servos, body", None),
        ("the whole loop: that and the pilot", LIMIT),
        ("the whole loop and its log", None),
    )
    period_s = 1.0 / prepared.run.cycle_hz
    rows = [Row("bare mj_step, ten steps", bare * 1e6, "us")]
    for (what, limit), cost_s in zip(names, others, strict=True):
        rows.append(Row(what, cost_s * 1e6, "us", "bare mj_step", cost_s / bare, limit))
        rows.append(Row("  real-time factor", period_s / cost_s, ""))
    return rows


def bare_s(model: mujoco.MjModel, states: list[State], steps: int) -> Floats:
    """CPU time of ``steps`` steps from each state, s."""
    data = mujoco.MjData(model)
    spent = []
    for qpos, qvel, force, warm in states:
        data.qpos[:], data.qvel[:] = qpos, qvel
        data.qfrc_applied[:], data.qacc_warmstart[:] = force, warm
        start = time.process_time()
        mujoco.mj_step(model, data, steps)
        spent.append(time.process_time() - start)
    return np.array(spent)


def body_s(prepared: WalkRun) -> Floats:
    """CPU time of each cycle of the plant alone under servos that make a travelling wave, s."""
    robot = SimulatedRobot(prepared)
    drive = robot.line.firmware.drive
    drive.torque_on[:] = 1.0
    period_s = 1.0 / prepared.run.cycle_hz
    spent = []
    for k in range(1, round(SECONDS / period_s)):
        drive.goal_rad[:] = travelling_wave(k * period_s, len(drive.goal_rad))
        start = time.process_time()
        robot.plant.advance(k * period_s, drive)
        spent.append(time.process_time() - start)
    return np.array(spent)
