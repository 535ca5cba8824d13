"""A log run again: the commands that were sent, at their times, to simulated servos.

Nothing decides again: no pilot, no safety. Differences from the log come from the servos, the body
and the ground; a log of the simulator must not differ.
"""

from collections.abc import Callable
from pathlib import Path
from typing import cast

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.metrics.comparison import Comparison, compare
from snakewalk.controller.run.backend import Backend
from snakewalk.controller.run.external.simulated_backend import simulated
from snakewalk.controller.run.factory import prepare_run
from snakewalk.controller.run.prepared_run import start_heading_rad
from snakewalk.controller.runlog.evidence import evidence_of_old_log
from snakewalk.controller.runlog.record import Header, InitialPose, RunRecord
from snakewalk.controller.runlog.topics import PoseTable
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.drivers.types import BodyPose, JointCommand


def replay(
    record: RunRecord, log: Path, on_progress: Callable[[int, int], None] | None = None
) -> Path:
    """Run a record's commands on the simulator and write what the servos then answer to ``log``.

    The rows keep the record's times, commands and verdicts; angles, currents, temperatures and pose
    are the simulator's. A record of metal begins with the joints as first measured.

    Args:
        record: a run, on metal or simulated; may be cut short.
        log: to be written.
        on_progress: called with the number of cycles done, and of all.

    Raises:
        InputError: the simulator is not installed, or the record holds no cycle.

    """
    cycle = record.cycle
    header = record.header
    if len(cycle.time_s) == 0:
        raise InputError("the log holds no cycle: there is nothing to replay")
    backend = _backend(record)
    chain = backend.chain
    clock = backend.clock
    robot = header.robot
    head_pose = cast(Callable[[], BodyPose], backend.pose)  # a simulated body always has one
    period_s = 1.0 / header.run.cycle_hz
    numbers = np.rint((cycle.deadline_s - cycle.deadline_s[0]) / period_s)
    total = len(cycle.time_s)
    with RunLog(log) as out:
        out.config(
            Header(
                header.run,
                robot,
                header.world,
                backend="sim",
                plan=header.plan,
                ground=header.ground,
                torque_constant_n_m_a=header.torque_constant_n_m_a,
                winding=header.winding,
                initial_pose=header.initial_pose,
                pose_evidence=evidence_of_old_log(header.run, "sim", robot.imu is not None),
            )
        )
        chain.enable()
        wire_s, start_s = backend.wire_busy_s(), clock.now_s()
        for k in range(total):
            due_s = start_s + numbers[k] * period_s
            clock.sleep_until_s(due_s)
            late_s = clock.now_s() - due_s
            state = chain.read()
            pose = head_pose()
            if cycle.verdict[k] != "veto":
                chain.write(JointCommand(clock.now_s(), cycle.sent_rad[k]))
                chain.check_servos()
            before_s, wire_s = wire_s, backend.wire_busy_s()
            out.cycle(
                cycle.time_s[k],
                cycle.asked_rad[k],
                cycle.sent_rad[k],
                state,
                deadline_s=cycle.deadline_s[k],
                lateness_s=late_s,
                wire_busy_s=wire_s - before_s,
                **backend.energy()._asdict(),
                verdict=cycle.verdict[k],
                reason=cycle.reason[k],
                joints=cycle.joints[k],
            )
            view = body_in_world(robot, pose, state.position_rad)
            out.add(
                PoseTable,
                cycle.time_s[k],
                head_m=pose.head_in_world_m,
                rotation=pose.rotation,
                links_m=view.link_m,
                centre_m=view.centre_m,
            )
            if on_progress is not None:
                on_progress(k + 1, total)
            if cycle.verdict[k] == "veto":
                break
        chain.disable()
    return log


def differences(
    original: RunRecord, again: RunRecord, tolerance_rad: float, tolerance_m: float
) -> Comparison:
    """Compare a run with its replay; joints and, where it was measured, the head decide.

    Velocities and currents are reported but do not decide. Neither does the head of a run whose
    pose was reckoned from the joints or measured by a camera. Angles that the original failed to
    read are left out.
    """
    header = original.header
    measured = header.backend == "sim" and header.run.pose_is_true
    reported_only = dict.fromkeys(("velocity_rad_s", "current_a"), float("inf"))
    limits = reported_only | {
        "measured_rad": tolerance_rad,
        "head_m": tolerance_m if measured else float("inf"),
    }
    return compare(original, again, tolerances=limits, valid=original.cycle.valid)


def _backend(record: RunRecord) -> Backend:
    header = record.header
    initial_pose = header.initial_pose
    if initial_pose is None:
        first = record.cycle.measured_rad[0]
        start_rad = first if np.isfinite(first).all() else np.zeros(header.robot.joint_count)
        initial_pose = InitialPose(_start_heading_rad(header), start_rad)
    return simulated(
        header.run, header.robot, header.world, build_ground(header.world), initial_pose
    )


def _start_heading_rad(header: Header) -> float:
    """Mean heading of a run on servos, also where its log alone does not hold the whole motion."""
    run = header.run
    if run.motion == "source":
        return run.start_heading_rad or 0.0
    if run.motion == "repertoire":
        return start_heading_rad(run)
    return prepare_run(run, header.robot, header.world).start_heading_rad
