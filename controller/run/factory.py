"""Factory of runs: from a configuration or a command's options to a ``PreparedRun``."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from snakewalk.config.camera import MappingConfig
from snakewalk.config.errors import InputError
from snakewalk.config.key_types import MOTION_S
from snakewalk.config.loader import (
    checked,
    load_robot,
    load_run,
    load_world,
)
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import MOTIONS, WALKS, RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.plugins import find, require, unknown
from snakewalk.controller.console.plugins import names as plugin_names
from snakewalk.controller.motion.parted_recording import recording
from snakewalk.controller.motion.policy import load_policy
from snakewalk.controller.motion.policy_motion import PolicyMotion
from snakewalk.controller.run.assembly import assemble, load_body
from snakewalk.controller.run.kinds.commanded_run import CommandedRun, MakeCommanded
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.kinds.playback_run import PlaybackRun
from snakewalk.controller.run.kinds.source_run import MakeSource, SourceRun
from snakewalk.controller.run.kinds.steered_run import SteeredRun
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.pose_provider import pose_plugin
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.run.run_keys import (
    OF_A_RECORDING,
    OF_A_SOURCE,
    checked_keys,
    with_keys_of,
)
from snakewalk.controller.run.servo_setup import check_servos, with_gains
from snakewalk.controller.track.readers.load import track_beside


def prepare_run(run: RunConfig, robot: RobotConfig, world: WorldConfig) -> PreparedRun:
    """Prepare a run from its configuration, such as that of a log.

    Raises:
        InputError: the configuration is incomplete, or has no waypoints.

    """
    if run.motion == "gait":
        return (SteeredRun if run.waypoints_m else GaitRun)(run, robot, world)
    if run.motion == "playback":
        return PlaybackRun(run, robot, world)
    if run.motion == "source":
        raise InputError(
            f"run {run.name}: its motion was the user's own, which no configuration holds; its "
            "goals are sent again by: snakewalk log replay LOG; a new run is made by prepare_source"
        )
    if run.motion not in WALKS:
        return _extension(run, robot, world)
    if not run.waypoints_m:
        raise InputError(f"run {run.name}: a {run.motion} needs waypoints")
    return WalkRun(run, robot, world)


def _extension(run: RunConfig, robot: RobotConfig, world: WorldConfig) -> PreparedRun:
    kind = find("run", run.motion)
    if kind is not None:
        prepared: PreparedRun = kind.load()(run, robot, world)
        return prepared
    source = find("motion", run.motion)
    if source is None:
        names = [*MOTIONS, *plugin_names("run"), *plugin_names("motion")]
        raise InputError(unknown("motion", run.motion, names))
    make: MakeSource = source.load()
    needs = make(robot).needs
    needs.check(robot, f"motion {run.motion}")
    return SourceRun(run, with_gains(robot, pitch=needs.pitch), world, make)


def prepare_walk(
    name: str,
    *,
    keys: Mapping[str, object] | None = None,
    on_paper: bool = False,
    **changes: object,
) -> WalkRun:
    """Load a walk's run like ``prepare_job``, which also accepts gaits along waypoints.

    Raises:
        ConfigError: every fault of a file at once.
        InputError: as ``prepare_job``, and for other motions than a walk.

    """
    job = prepare_job(name, keys=keys, on_paper=on_paper, **changes)
    if isinstance(job, SteeredRun):
        raise InputError(
            f"run {job.run.name}: a gait along waypoints; run it by: snakewalk run {name}"
        )
    if not isinstance(job, WalkRun):
        raise InputError(
            f"run {job.run.name}: motion {job.run.motion} is not a walk; run it by: "
            f"snakewalk run {name}"
        )
    return job


def prepare_job(
    name: str,
    *,
    keys: Mapping[str, object] | None = None,
    on_paper: bool = False,
    **changes: object,
) -> PreparedRun:
    """Load a run with its robot and world; ``changes`` replace fields of the run where not None.

    ``keys`` replace single values of the three files: ``run.seed``, ``robot.link_mass_kg``,
    ``world.ground.slope_rad``, or ``slope_deg``. ``on_paper`` allows motions that no robot makes by
    itself.

    Raises:
        ConfigError: every fault of a file at once. InputError: the configuration cannot be
        realised, or does not fit the wire.

    """
    keys = checked_keys(keys)
    run = load_run(name)
    folder = Path(name).parent if name.endswith(".toml") else None
    options = {key: value for key, value in changes.items() if value is not None}
    options.setdefault("track", track_beside(run.track, folder))
    if folder is not None and (folder / run.robot).is_file():
        options.setdefault("robot", str(folder / run.robot))
    run = checked(RunConfig, run.model_dump() | options, "command line")
    run = with_keys_of("run", run, keys)
    _refuse_other_commands(run, on_paper)
    if run.pose is not None:
        pose_plugin(run.pose)
    robot = run.walk.pitch.set_up(load_robot(run.robot, folder))
    robot = with_keys_of("robot", robot, keys)
    check_servos(run, robot)
    world = with_keys_of("world", load_world(run.world, folder), keys)
    if run.motion not in MOTIONS:
        return _extension(run, robot, world)
    if run.motion == "gait":
        if changes.get("track") is not None:
            raise InputError(f"run {run.name}: moves by a gait: leave --track out")
        steered = SteeredRun(run, robot, world)
        steered.check_plan()
        gait = steered.gait
        soft = [gait.p_gain] if gait.p_gain is not None else []
        return replace(steered, robot=with_gains(robot, pitch=gait.needs.pitch, soft=soft))
    _reject_legs(robot)
    _refuse_one_joint(robot)
    return WalkRun(run, robot, world)


def _refuse_other_commands(run: RunConfig, on_paper: bool) -> None:
    """Reject a motion that another command runs.

    Raises:
        InputError: with that command.

    """
    commands = {
        "playback": "a recording is played by: snakewalk play TRACK",
        "repertoire": "planned by: snakewalk plan --with repertoire; without waypoints played by: "
        "snakewalk gait repertoire play",
        "source": "a source of your own is run by prepare_source",
    }
    if not on_paper:
        commands["kp"] = (
            "kp is a motion on paper: snakewalk animal synthesise RUN --motion kp -o NAME, then "
            "snakewalk play NAME.npz"
        )
    if not run.waypoints_m:
        commands["gait"] = "a gait is run by: snakewalk gait run NAME"
    if run.motion in commands:
        raise InputError(f"run {run.name}: {commands[run.motion]}")


def _refuse_one_joint(robot: RobotConfig) -> None:
    """Reject a body with one yaw joint: such a motion leads nowhere.

    Raises:
        InputError: it has one yaw joint.

    """
    if len(robot.yaw_joints) == 1:
        raise InputError(
            f"robot {robot.name}: has one yaw joint, but a walk needs two, and more for "
            "steering; choose another robot"
        )


def _reject_legs(robot: RobotConfig) -> None:
    if robot.limbs:
        raise InputError(
            f"robot {robot.name}: walks and recordings move a body without legs; a robot with legs "
            "runs gaits (snakewalk gait run), gaits along waypoints (snakewalk run "
            "salamander-square) and sources of your own"
        )


def with_map(run: RunConfig, source: str | None) -> RunConfig:
    """Return a run that knows its ground, or maps it; None leaves the run's setting.

    Raises:
        InputError: the source is neither ``world`` nor a plug-in.

    """
    if source is None:
        return run
    if source == "world":
        return run.model_copy(update={"mapping": None})
    require("map", source, "--map", ["world"])
    table = (run.mapping or MappingConfig()).model_copy(update={"source": source})
    return run.model_copy(update={"mapping": table})


def changed(prepared: PreparedRun, **fields: object) -> PreparedRun:
    """Return a prepared run with changed fields, for example ``run`` or ``world``."""
    prepared_run: PreparedRun = replace(prepared, **fields)  # type: ignore[type-var]
    return prepared_run


def prepare_playback(
    track: str,
    *,
    robot: str | None = None,
    world: str | None = None,
    keys: Mapping[str, object] | None = None,
    **playback: object,
) -> PlaybackRun:
    """Prepare to play a recording; ``keys`` as in ``prepare_walk``.

    ``playback`` contains fields of ``PlaybackConfig``.

    Raises:
        InputError: the recording does not exist, bends joints too far, or is too fast.

    """
    keys = checked_keys(keys, OF_A_RECORDING)
    body = load_body(robot or "yaw16", keys)
    fields = {
        "name": Path(track).stem,
        "robot": body.name,
        "world": world or "flat",
        "track": track,
        "motion": "playback",
        "playback": playback,
    }
    _reject_legs(body)
    run, ground = assemble(fields, keys, body)
    prepared = PlaybackRun(run, body, ground)
    recording(body, *prepared.joint_track).needs.check(body, "this recording")
    if "run.time_limit_s" in keys:
        return prepared
    limit = {"time_limit_s": prepared.duration_s + 30.0}
    return replace(prepared, run=run.model_copy(update=limit))


def prepare_source(
    make: MakeSource,
    *,
    robot: str | None = None,
    world: str | None = None,
    seconds: float = MOTION_S,
    seed: int = 0,
    name: str = "source",
    keys: Mapping[str, object] | None = None,
) -> SourceRun:
    """Prepare a run of your own motion source, of at most ``seconds``; it ends earlier when done.

    ``make`` receives the robot and returns a fresh source at each call: one is stepped on paper
    before torque is on, another one in the run. ``keys`` as for ``prepare_walk``.

    Raises:
        InputError: the robot lacks joints that the source needs, or its cycle does not fit the
            wire; limits of the joints are checked by ``run_robot``.

    """
    keys = checked_keys(keys, OF_A_SOURCE)
    body = load_body(robot or "yaw16", keys)
    needs = make(body).needs
    needs.check(body, "the motion source")
    fields = {
        "name": name,
        "robot": body.name,
        "world": world or "flat",
        "motion": "source",
        "seed": seed,
        "time_limit_s": seconds,
    }
    run, ground = assemble(fields, keys, body, origin="prepare_source")
    return SourceRun(run, with_gains(body, pitch=needs.pitch), ground, make)


def prepare_policy(
    name: str,
    *,
    robot: str | None = None,
    world: str | None = None,
    seconds: float = MOTION_S,
    seed: int = 0,
    keys: Mapping[str, object] | None = None,
) -> SourceRun:
    """Prepare a learnt policy, shipped or from a file; it comes to rest after ``seconds``.

    Robot and world are by default those of its training.

    Raises:
        InputError: the policy does not exist, or does not know the robot's joints.

    """
    policy = load_policy(name)
    return prepare_source(
        lambda body: PolicyMotion(policy, body, duration_s=seconds),
        robot=robot or policy.robot,
        world=world or policy.origin.world,
        seconds=seconds + 30.0,
        seed=seed,
        name=policy.name,
        keys=keys,
    )


def prepare_commanded(
    make: MakeCommanded,
    *,
    robot: str | None = None,
    world: str | None = None,
    seconds: float,
    name: str,
    keys: Mapping[str, object] | None = None,
) -> CommandedRun:
    """Prepare a run that another program commands, for at most ``seconds``.

    Pitch joints are set up as for gaits; ``keys`` as in ``prepare_walk``.

    Raises:
        InputError: robot or world do not exist, or the cycle does not fit the wire.

    """
    keys = checked_keys(keys, OF_A_SOURCE)
    body = load_body(robot or "yaw16", keys)
    fields = {
        "name": name,
        "robot": body.name,
        "world": world or "flat",
        "motion": "source",
        "time_limit_s": seconds,
    }
    run, ground = assemble(fields, keys, body)
    return CommandedRun(run, with_gains(body, pitch=bool(len(body.pitch_joints))), ground, make)
