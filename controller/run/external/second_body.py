"""Second body of a run: in this process for a simulated robot, in a worker for a port."""

from collections.abc import Callable
from contextlib import ExitStack
from functools import cache
from importlib.util import find_spec
from typing import cast

from snakewalk.config.world import FlatGround, WaterGround
from snakewalk.controller.motion.source import MotionSource
from snakewalk.controller.pose.measured_friction import MeasuredFriction
from snakewalk.controller.run.backend import Backend
from snakewalk.controller.run.external.twin_worker import ProcessTwin, RehearsedTwin, TwinTrial
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.pose_provider import PoseProvider
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.runtime.friction_estimator import FrictionEstimator
from snakewalk.controller.runtime.friction_monitor import (
    FrictionMonitor,
    OnPaper,
    OnTwin,
    SlideModel,
)
from snakewalk.controller.walk.twin import UsesFriction
from snakewalk.controller.walk.twin_answers import AsksTwin, TwinAsker
from snakewalk.controller.walk.twin_rollout import TwinRollout, UsesTwin


def use_worker(
    prepared: PreparedRun,
    source: MotionSource,
    now_s: Callable[[], float] | None,
    until: ExitStack,
) -> None:
    """Let a walk over known hills use a second body in another process.

    Without MuJoCo the walk has only its prediction.

    Args:
        prepared: run on a port, with a measured pose.
        source: its motion.
        now_s: simulated time of a rehearsal; None: the worker replies in real time.
        until: ends the worker.

    """
    run = prepared.run
    robot = prepared.robot
    world = prepared.world
    if not isinstance(prepared, WalkRun) or not isinstance(source, AsksTwin):
        return
    if run.motion != "walk" or not _tries_pieces(prepared) or find_spec("mujoco") is None:
        return
    twin: RehearsedTwin | ProcessTwin
    if now_s is None:
        twin = ProcessTwin(run, robot, world)
    else:
        twin = RehearsedTwin(TwinTrial(run, robot, world), now_s)
    until.callback(twin.close)
    source.use_asker(TwinAsker(robot, twin, world.friction))


def second_body(
    prepared: PreparedRun, source: MotionSource, backend: Backend, pose: PoseProvider
) -> FrictionEstimator | None:
    """Give a walk over known ground a second body, if available.

    Returns:
        The friction estimator. From an external pose it uses the traction model where the ground
            under the body is a plane; otherwise it uses the model on a level floor and the second
            body elsewhere. None if the pose assumes the friction (joints, IMU).

    """
    run = prepared.run
    world = prepared.world
    robot = prepared.robot
    if not _is_bare_on_known_ground(prepared):
        return None
    twin = cache(backend.twin) if backend.twin is not None and run.pose_is_true else None
    if twin is not None and _tries_pieces(prepared) and isinstance(source, UsesTwin):
        source.use_twin(TwinRollout(robot, twin, world.friction))
    finds = run.motion == "walk" and run.walk.finds_friction and isinstance(source, UsesFriction)
    if not finds or isinstance(world.ground, WaterGround):
        return None
    is_level = isinstance(world.ground, FlatGround) and world.obstacle is None
    use = cast(UsesFriction, source).use_friction
    if pose.measured_heads is not None:
        if world.obstacle is not None or not (is_level or prepared.ground):
            return None
        ground = None if is_level else prepared.ground
        return MeasuredFriction(world.friction, pose.measured_heads, use, ground)
    if run.pose != "camera" and (not run.pose_is_true or backend.pose is None):
        return None
    if is_level:
        model: SlideModel = OnPaper()  # moves no second body in every walk
    elif twin is not None:
        model = OnTwin(robot, twin)
    else:
        return None
    return FrictionMonitor(world.friction, model, 1.0 / run.cycle_hz, use)


def _tries_pieces(prepared: PreparedRun) -> bool:
    may_try = prepared.run.walk.tries > 0 and prepared.ground is not None
    return may_try and _is_bare_on_known_ground(prepared)


def _is_bare_on_known_ground(prepared: PreparedRun) -> bool:
    return prepared.run.mapping is None and not prepared.robot.limb_joints
