"""A simulated robot at the start of a run, and what watches its cycles."""

import time
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.controller.runtime.drive import Drive, OnProgress, Progress, Sensors, Watchers
from snakewalk.controller.runtime.friction_monitor import FrictionMonitor, OnPaper
from snakewalk.controller.runtime.loop import ticks
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.servo.bank import ServoBank

Floats = NDArray[np.float64]
State = tuple[Floats, Floats, Floats, Floats]


class Recorder:
    """Keeps what the body was doing in every cycle: position, velocity, force, warm start."""

    def __init__(self, data: mujoco.MjData) -> None:
        self._data = data
        self.states: list[State] = []

    def on_progress(self, progress: Progress) -> None:
        """Copy the state."""
        d = self._data
        self.states.append(
            (d.qpos.copy(), d.qvel.copy(), d.qfrc_applied.copy(), d.qacc_warmstart.copy())
        )


class Stopwatch:
    """CPU time of each cycle, from the end of the one before."""

    def __init__(self) -> None:
        self._ends: list[float] = []

    def on_progress(self, progress: Progress) -> None:
        """Take the time."""
        self._ends.append(time.process_time())

    @property
    def cycle_s(self) -> Floats:
        """Cost of each cycle but the first, s."""
        return np.diff(self._ends)


class NoLog(RunLog):
    """Takes everything and writes nothing."""

    def __init__(self) -> None:
        """Open no file."""

    def cycle(self, *given: Any, **named: Any) -> None:
        """Nothing."""

    def add(self, *given: Any, **named: Any) -> None:
        """Nothing."""

    def event(self, *given: Any, **named: Any) -> None:
        """Nothing."""


def travelling_wave(time_s: float, joints: int) -> Floats:
    """(J,) goals of a wave that grows within two seconds."""
    grown = 0.4 * min(1.0, 0.5 * time_s)
    return np.asarray(grown * np.sin(3.0 * time_s - np.arange(joints) / 2.2))


class SimulatedRobot:
    """Body, servos, line, chain and safety as ``snakewalk run`` joins them."""

    def __init__(self, prepared: WalkRun) -> None:
        run, robot = prepared.run, prepared.robot
        self._prepared = prepared
        self.plant = MujocoPlant(robot, prepared.world, prepared.ground, run.physics_step_s)
        straight = np.zeros(robot.joint_count)
        self.plant.reset(run.start_m, prepared.start_heading_rad, straight)
        servo = robot.servo
        bank = ServoBank(robot.servo_ids, servo.model, servo.baud)
        self.line = SimLine(bank, self.plant)
        chain = ServoChain(DynamixelBus(self.line, servo.model), robot)
        limits = SafetyLimits.from_config(robot, run.safety)
        self.link = SafeLink(chain, limits, self.line.clock)

    def walk(self, log: RunLog, on_progress: OnProgress) -> None:
        """Run the job, on a level floor, until its time limit."""
        run, pilot = self._prepared.run, self._prepared.pilot()
        file, period_s = self._prepared.world.friction, 1.0 / run.cycle_hz
        friction = FrictionMonitor(file, OnPaper(), period_s, pilot.use_friction)
        drive = Drive(
            link=self.link,
            clock=self.line.clock,
            sensors=Sensors(lambda _: self.plant.head_pose(), lambda: self.line.busy_s),
            motion=pilot,
            log=log,
            plan=self._prepared,
            watchers=Watchers(on_progress=on_progress),
            friction=friction if run.walk.finds_friction else None,
        )
        tripped = drive.run().tripped
        if tripped:
            raise RuntimeError(tripped)

    def wave(self, seconds: float, on_progress: OnProgress) -> None:
        """Read the joints and write a travelling wave, nothing else."""
        joints = self._prepared.robot.joint_count
        with self.link:
            self.link.enable()
            clock, hz = self.line.clock, self._prepared.run.cycle_hz
            start_s = clock.now_s()
            for tick in ticks(clock, 1.0 / hz, start_s + seconds):
                self.link.read()
                goal = travelling_wave(tick.deadline_s - start_s, joints)
                self.link.write(JointCommand(tick.deadline_s, goal))
                on_progress(Progress(tick.deadline_s, 0.0, 0, 0.0, done=False))
