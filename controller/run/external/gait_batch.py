"""Gait runs whose robots are advanced together; each leaves the log of a run.

The loop is that of ``controller.runtime.drive`` without a bus: ramp, derating, motion, safety.
"""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.kinematics.links import SpineLinks
from snakewalk.controller.kinematics.ramp import Ramp
from snakewalk.controller.run.external.robot_batch import BatchRow, RobotBatch
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.servo_setup import motor_constants
from snakewalk.controller.runlog.evidence import SIMULATED
from snakewalk.controller.runlog.record import Header
from snakewalk.controller.runlog.topics import PoseTable
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.controller.runtime.cycle_row import log_cycle
from snakewalk.controller.runtime.derating import Derating
from snakewalk.controller.runtime.drive import SETTLE_S
from snakewalk.controller.runtime.loop import Tick
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.batch.bodies import BatchBodies

MakeBodies = Callable[[RobotConfig, WorldConfig, int, float | None], BatchBodies]
BACKEND = "batch"
"""Name of the backend in logs."""


@dataclass(frozen=True, slots=True)
class BatchOutcome:
    """How a run of a batch ended."""

    tripped: str | None
    least_rate: float


def run_together(
    prepared: Sequence[GaitRun],
    logs: Sequence[Path],
    make_bodies: MakeBodies,
    on_cycle: Callable[[float], None] = lambda time_s: None,
) -> list[BatchOutcome]:
    """Run gaits to their ends, and write a log of each.

    Args:
        prepared: runs of one robot on one level floor; gains and friction may differ.
        logs: files of the logs.
        make_bodies: makes the bodies of a robot, a world, a number of them, and a step (s).
        on_cycle: called after each control cycle, with its time.

    Raises:
        InputError: robot or world are not supported, or a plan breaks a limit.

    """
    first = prepared[0]
    bodies = make_bodies(first.robot, first.world, len(prepared), first.run.physics_step_s)
    batch = RobotBatch(first.run, bodies)
    period_s = 1.0 / first.run.cycle_hz
    cycle = 0
    with ExitStack() as stack:
        opened = [stack.enter_context(RunLog(path)) for path in logs]
        runs = [
            _Row(batch, number, prepared_run, log)
            for number, (prepared_run, log) in enumerate(zip(prepared, opened, strict=True))
        ]
        while live := [run for run in runs if not run.is_over]:
            for run in live:
                run.step(cycle * period_s)
            cycle += 1
            batch.advance(cycle * period_s)
            on_cycle(cycle * period_s)
    return [BatchOutcome(run.link.tripped, run.derating.least) for run in runs]


class _Row:
    def __init__(self, batch: RobotBatch, number: int, prepared: GaitRun, log: RunLog) -> None:
        run = prepared.run
        robot = prepared.robot
        plan = prepared.check_plan()
        pose = prepared.initial_pose()
        self.body: BatchRow = batch.start(number, robot, prepared.world, pose)
        self.link = SafeLink(self.body, SafetyLimits.from_config(robot, run.safety), self.body)
        self.log = log
        torque_constant_n_m_a, winding = motor_constants(robot)
        self.log.config(
            Header(
                run,
                robot,
                prepared.world,
                backend=BACKEND,
                plan=plan,
                initial_pose=pose,
                torque_constant_n_m_a=torque_constant_n_m_a,
                winding=winding,
                pose_evidence=SIMULATED,
            )
        )
        self.is_over = False
        self._motion = prepared.make_source(self._event)
        self.derating = Derating(run.safety, robot, self._event, self.link.load)
        self._spine = SpineLinks.of(robot)
        self._period_s = 1.0 / run.cycle_hz
        self.log.event(0.0, "start", "torque on; ramp to the shape")
        try:
            state = self.link.enable()
        except SafetyTrippedError:
            state = self.link.read()
            self._end(0.0)
        self._ramp = Ramp(
            state.position_rad,
            self._motion.goal_rad(),
            robot.joint_speed_limit_rad_s,
            robot.joint_acceleration_limit_rad_s2,
        )
        self._walk_s = self._ramp.duration_s + SETTLE_S
        self._end_s = self._walk_s + run.time_limit_s

    def _event(self, kind: str, text: str) -> None:
        self.log.event(self.body.now_s(), kind, text)

    def step(self, time_s: float) -> None:
        state = self.link.read()
        pose = self.body.head_pose()
        view = self._spine.in_world(pose, state.position_rad)
        if time_s < self._walk_s:
            goal = self._ramp.at(time_s)
        else:
            sent = self.link.last_verdict
            before_rad = state.position_rad if sent is None else sent.goal_rad
            rate = self.derating.update(state, before_rad, self._period_s)
            goal = self._motion.step(self._period_s * rate, view)
        with suppress(SafetyTrippedError):
            self.link.write(JointCommand(self.body.now_s(), goal))
        log_cycle(
            self.log,
            self.link,
            state,
            goal,
            tick=Tick(0, time_s, 0.0, 0),
            wire_busy_s=float("nan"),
            energy=self.body.energy(),
        )
        self.log.add(
            PoseTable,
            time_s,
            head_m=pose.head_in_world_m,
            rotation=pose.rotation,
            links_m=view.link_m,
            centre_m=view.centre_m,
        )
        if self.link.tripped or self._motion.done or time_s > self._end_s:
            self._end(time_s)

    def _end(self, time_s: float) -> None:
        if self.link.tripped:
            self.log.event(time_s, "trip", self.link.tripped, "error")
        self.link.disable()
        self.log.event(time_s, "stop", "torque off")
        self.is_over = True
