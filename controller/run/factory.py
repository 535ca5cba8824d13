"""The one factory of runs: from a configuration, or a command's options, to a ``PreparedRun``."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Literal, TypeVar

from snakewalk.config.camera import MappingConfig
from snakewalk.config.compliance import ComplianceConfig
from snakewalk.config.errors import InputError
from snakewalk.config.gait import GaitSetConfig
from snakewalk.config.loader import (
    checked,
    load_gait,
    load_robot,
    load_run,
    load_world,
    shipped,
    with_keys,
)
from snakewalk.config.playback import ScheduleConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.gaits.gait import Gait, fitting_robot
from snakewalk.controller.gaits.registry import GAITS, make_gait
from snakewalk.controller.motion.policy import load_policy
from snakewalk.controller.motion.policy_motion import PolicyMotion
from snakewalk.controller.motion.recorded import Recorded
from snakewalk.controller.repertoire.repertoire import load_repertoire
from snakewalk.controller.repertoire.schedule_run import ScheduleRun
from snakewalk.controller.run.commanded_run import CommandedRun, MakeCommanded
from snakewalk.controller.run.gait_run import GaitRun, MakeOperator
from snakewalk.controller.run.playback_run import PlaybackRun
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.run.source_run import MakeSource, SourceRun
from snakewalk.controller.run.steered_run import SteeredRun
from snakewalk.controller.run.walk_run import WalkRun
from snakewalk.controller.track.readers.load import track_beside
from snakewalk.drivers.bus.budget import robot_budget

C = TypeVar("C", RunConfig, RobotConfig, WorldConfig)
_FIELDS = {
    "run": tuple(RunConfig.model_fields),
    "robot": tuple(RobotConfig.model_fields),
    "world": tuple(WorldConfig.model_fields),
}
"""Keys and tables at the top of each file."""

GAIT_PITCH_SHARE = 0.75
"""Goal current of the pitch joints in a motion that lifts, of the current at which safety stops
(1.5 A of an XM430; ours): soft ones would not carry the links."""

_OWN_MOTION = {"run.robot": "--robot", "run.motion": "the command"}
_OF_A_SOURCE = _OWN_MOTION | {"run.time_limit_s": "--seconds"}
_OF_A_GAIT = _OWN_MOTION | {"run.gait": "--param, --seconds, --then, --by, --look-heading-rad"}
_OF_A_SCHEDULE = _OWN_MOTION | {"run.repertoire": "FILE, --speed, --turn, --schedule, --seconds"}
_OF_A_RECORDING = _OWN_MOTION | {"run.track": "TRACK", "run.playback": "--speed, --scale, --clip"}
"""Keys that a run of one command takes from that command, by the options that give them."""


def prepare_run(run: RunConfig, robot: RobotConfig, world: WorldConfig) -> PreparedRun:
    """Prepare a run from its configuration, for example from that in a log.

    Raises:
        InputError: the configuration alone does not hold the run, or has no waypoints to walk to.

    """
    if run.motion == "gait":
        return (SteeredRun if run.waypoints_m else GaitRun)(run, robot, world)
    if run.motion == "playback":
        return PlaybackRun(run, robot, world)
    if run.motion == "repertoire":
        if run.repertoire is not None:
            return ScheduleRun(run, robot, world)
        raise InputError(f"run {run.name}: made again by: snakewalk repertoire run PLAN")
    if run.motion == "source":
        raise InputError(
            f"run {run.name}: its motion was the user's own, which no configuration holds; its "
            "goals are sent again by: snakewalk replay LOG; a new run is made by prepare_source"
        )
    if not run.waypoints_m:
        raise InputError(f"run {run.name}: a {run.motion} needs waypoints")
    return WalkRun(run, robot, world)


def prepare_walk(
    name: str,
    *,
    keys: Mapping[str, object] | None = None,
    on_paper: bool = False,
    **changes: object,
) -> WalkRun:
    """Load a walk's run: as ``prepare_job``, which takes gaits along waypoints, too.

    Raises:
        ConfigError: every fault of a file at once.
        InputError: as ``prepare_job``, and for a gait.

    """
    found = prepare_job(name, keys=keys, on_paper=on_paper, **changes)
    if isinstance(found, SteeredRun):
        raise InputError(
            f"run {found.run.name}: a gait along waypoints; run it by: snakewalk run {name}"
        )
    return found


def prepare_job(
    name: str,
    *,
    keys: Mapping[str, object] | None = None,
    on_paper: bool = False,
    **changes: object,
) -> WalkRun | SteeredRun:
    """Load a run with its robot and world; ``changes`` replace fields of the run where not None.

    ``keys`` replace single values of the three files: ``run.seed``, ``robot.link_mass_kg``,
    ``world.ground.slope_rad``, or ``slope_deg``. ``on_paper`` allows motions that no robot makes by
    itself.

    Raises:
        ConfigError: every fault of a file at once.
        InputError: what the configuration asks cannot be made, or does not fit the wire.

    """
    keys = _checked_keys(keys)
    run = load_run(name)
    beside = Path(name).parent if name.endswith(".toml") else None
    options = {key: value for key, value in changes.items() if value is not None}
    options.setdefault("track", track_beside(run.track, beside))
    run = checked(RunConfig, run.model_dump() | options, "command line")
    run = with_keys_of("run", run, keys)
    if run.motion == "kp" and not on_paper:
        raise InputError(
            f"run {run.name}: kp is a motion on paper: snakewalk synthesise RUN --motion kp "
            "-o NAME, then snakewalk play NAME.npz"
        )
    if run.motion == "gait" and not run.waypoints_m:
        raise InputError(f"run {run.name}: a gait is run by: snakewalk gait run NAME")
    if run.motion == "playback":
        raise InputError(f"run {run.name}: a recording is played by: snakewalk play TRACK")
    if run.motion == "repertoire":
        raise InputError(
            f"run {run.name}: planned by: snakewalk plan --with repertoire; without waypoints "
            "played by: snakewalk repertoire play"
        )
    if run.motion == "source":
        raise InputError(f"run {run.name}: a source of your own is run by prepare_source")
    robot = run.walk.pitch.set_up(load_robot(run.robot, beside))
    robot = with_keys_of("robot", robot, keys)
    _check_servos(run, robot)
    world = with_keys_of("world", load_world(run.world, beside), keys)
    if run.motion == "gait":
        if changes.get("track") is not None:
            raise InputError(f"run {run.name}: moves by a gait: leave --track out")
        steered = SteeredRun(run, robot, world)
        steered.check_plan()
        gait = steered.gait
        soft = [gait.p_gain] if gait.p_gain is not None else []
        return replace(steered, robot=_with_gains(robot, pitch=gait.needs.pitch, soft=soft))
    _refuse_legs(robot)
    _refuse_one_joint(robot)
    return WalkRun(run, robot, world)


def _checked_keys(
    keys: Mapping[str, object] | None, refused: Mapping[str, str] | None = None
) -> dict[str, object]:
    """Return keys of the three files, angles in rad; ``refused`` keys or tables have options.

    Raises:
        InputError: a key is of none of the files, or is refused; one line each.

    """
    faults: list[str] = []
    for key in keys or {}:
        file, dot, rest = key.partition(".")
        if file not in _FIELDS or not (dot and all(rest.split("."))):
            faults.append(f"{key}: a key begins with run., robot. or world.{_meant(file, rest)}")
        for own, option in (refused or {}).items():
            if key == own or key.startswith(f"{own}."):
                faults.append(f"{key}: is given by {option}")
    if faults:
        raise InputError(faults)
    return dict(_in_rad(key, value) for key, value in (keys or {}).items())


def _meant(first: str, rest: str) -> str:
    """Say which key was meant where the first word is that of no file."""
    files = get_close_matches(first, _FIELDS, 1, 0.7)
    if files and rest:
        return f"; did you mean {files[0]}.{rest}?"
    for file, fields in _FIELDS.items():
        for near in get_close_matches(first, fields, 1, 0.7):
            return f"; did you mean {'.'.join(filter(None, (file, near, rest)))}?"
    return ""


def _in_rad(key: str, value: object) -> tuple[str, object]:
    """Files have radians; people think of slopes in degrees."""
    if not key.endswith("_deg"):
        return key, value
    if isinstance(value, int | float) and not isinstance(value, bool):
        value = math.radians(value)
    return f"{key.removesuffix('_deg')}_rad", value


def gait_keys(keys: Mapping[str, object] | None) -> dict[str, object]:
    """Return keys of run, robot and world that a gait's run takes, angles in rad.

    Raises:
        InputError: a key is of none of the files, or has an option of its own; one line each.

    """
    return _checked_keys(keys, _OF_A_GAIT)


def with_keys_of(file: str, config: C, keys: Mapping[str, object]) -> C:
    """Replace values of the run's, the robot's or the world's file by their keys.

    Raises:
        InputError: one line per fault.

    """
    own = {k.removeprefix(f"{file}."): v for k, v in keys.items() if k.startswith(f"{file}.")}
    return with_keys(config, own, f"{file} {config.name}") if own else config


def _refuse_one_joint(robot: RobotConfig) -> None:
    """Refuse a body that can only bend to and fro: such a motion leads nowhere.

    Raises:
        InputError: it has one yaw joint.

    """
    if len(robot.yaw_joints) == 1:
        raise InputError(
            f"robot {robot.name}: has one yaw joint, which only bends to and fro; a walk takes two "
            "at least, and more to steer"
        )


def _refuse_legs(robot: RobotConfig) -> None:
    if robot.limbs:
        raise InputError(
            f"robot {robot.name}: walks and recordings move a body without legs; a robot with legs "
            "runs gaits (snakewalk gait run), gaits along waypoints (snakewalk run "
            "salamander-square) and sources of your own"
        )


def prepare_gait(
    name: str,
    *,
    robot: str | None = None,
    world: str | None = None,
    parameters: dict[str, Any] | None = None,
    seconds: float = 20.0,
    seed: int = 0,
    look_heading_rad: float | None = None,
    look_at_m: tuple[float, float] | None = None,
    make_operator: MakeOperator | None = None,
    then: Sequence[tuple[float, str, dict[str, Any]]] = (),
    by: Literal["blend", "cpg"] = "blend",
    keys: Mapping[str, object] | None = None,
) -> GaitRun:
    """Prepare a gait, or a shipped or own set of parameters (``config/gaits``), by name.

    ``then`` holds (time, name, parameters) of the gaits that follow, ``by`` how the gait changes,
    ``keys`` values of run, robot and world that are replaced, as of ``prepare_walk``.

    Raises:
        InputError: no such gait, parameters out of range, a robot that lacks joints, changes out of
            order or together with an operator.

    """
    if make_operator is not None and (then or by == "cpg"):
        raise InputError("--live changes gaits by keys and joins: leave out --then and --by cpg")
    keys = gait_keys(keys)
    gait, known = gait_by_name(name, parameters)
    if known is not None:
        robot, world = robot or known.robot, world or known.world
    changes = [(at_s, gait_by_name(other, values)[0]) for at_s, other, values in then]
    gaits = [gait, *(other for _, other in changes)]
    pitch = any(each.needs.pitch for each in gaits)
    own = robot or fitting_robot(each.needs for each in gaits)
    body = with_keys_of("robot", load_robot(own), keys)
    for each in gaits:
        each.check(body)
    run = checked(
        RunConfig,
        {
            "name": name.removesuffix(".toml").rpartition("/")[2],
            "robot": body.name,
            "world": world or gait.world,
            "motion": "gait",
            "seed": seed,
            "time_limit_s": seconds + (60.0 if by == "cpg" else 30.0),
            "gait": {
                "name": gait.name,
                "parameters": gait.params.model_dump(),
                "duration_s": seconds,
                "look_heading_rad": look_heading_rad,
                "look_at_m": look_at_m,
                "then": [
                    {"at_s": at_s, "name": g.name, "parameters": g.params.model_dump()}
                    for at_s, g in changes
                ],
                "by": by,
            },
            "compliance": known.compliance if known is not None else None,
        },
        "command line",
    )
    run = with_keys_of("run", run, keys)
    _check_servos(run, body)
    soft = [gait.p_gain for gait in gaits if gait.p_gain is not None]
    body = _with_gains(body, pitch=pitch, soft=soft)
    ground = with_keys_of("world", load_world(run.world), keys)
    return GaitRun(run, body, ground, make_operator)


def is_gait(name: str) -> bool:
    """Whether this is the name of a gait or of a shipped set of its parameters."""
    return name in GAITS or name in shipped("gaits")


def moves_by_gait(name: str) -> bool:
    """Whether this names a gait, or a run that goes along its waypoints by a gait."""
    return is_gait(name) or load_run(name).motion == "gait"


def with_compliance(run: RunConfig, on: bool | None) -> RunConfig:
    """Let joints yield, by the run's own table if it has one, or not; None: as the run says."""
    if on is None:
        return run
    table = (run.compliance or ComplianceConfig()) if on else None
    return run.model_copy(update={"compliance": table})


def with_map(run: RunConfig, source: str | None) -> RunConfig:
    """Let the walk know the ground of its world, or map it as it goes; None: as the run says.

    Raises:
        InputError: the source is neither ``world`` nor ``stereo``.

    """
    if source not in (None, "world", "stereo"):
        raise InputError(f"--map {source}: the walk knows its ground from: world, stereo")
    if source is None:
        return run
    table = (run.mapping or MappingConfig()) if source == "stereo" else None
    return run.model_copy(update={"mapping": table})


def prepare_playback(
    track: str,
    *,
    robot: str | None = None,
    world: str | None = None,
    speed: float | None = None,
    scale: float = 1.0,
    clip: bool = False,
    keys: Mapping[str, object] | None = None,
) -> PlaybackRun:
    """Prepare to play a recording; ``keys`` as of ``prepare_walk``.

    Raises:
        InputError: no such recording, joints that do not bend so far, too fast for them.

    """
    keys = _checked_keys(keys, _OF_A_RECORDING)
    body = with_keys_of("robot", load_robot(robot or "yaw16"), keys)
    fields = {
        "name": Path(track).stem,
        "robot": body.name,
        "world": world or "flat",
        "track": track,
        "motion": "playback",
        "playback": {"speed": speed, "scale": scale, "clip": clip},
    }
    run = with_keys_of("run", checked(RunConfig, fields, "command line"), keys)
    _refuse_legs(body)
    _check_servos(run, body)
    prepared = PlaybackRun(run, body, with_keys_of("world", load_world(run.world), keys))
    Recorded(body, *prepared.joint_track).needs.check(body, "this recording")
    if "run.time_limit_s" in keys:
        return prepared
    limit = {"time_limit_s": prepared.duration_s + 30.0}
    return replace(prepared, run=run.model_copy(update=limit))


def prepare_schedule(
    file: Path,
    schedule: ScheduleConfig,
    *,
    robot: str | None = None,
    world: str | None = None,
    patience: int | None = None,
    seed: int = 0,
    keys: Mapping[str, object] | None = None,
) -> ScheduleRun:
    """Prepare to play recorded actions by wanted speed and turn; ``keys`` as of ``prepare_walk``.

    Robot and world are by default those of the recording.

    Raises:
        InputError: no repertoire, or one of other joints; a ground that is not flat.

    """
    keys = _checked_keys(keys, _OF_A_SCHEDULE)
    recorded = load_repertoire(file)
    body = with_keys_of("robot", load_robot(robot or recorded.robot), keys)
    fields = {
        "name": file.stem,
        "robot": body.name,
        "world": world or recorded.world,
        "motion": "repertoire",
        "seed": seed,
        "time_limit_s": schedule.duration_s + 30.0,
        "repertoire": schedule.model_dump() | {"file": str(file), "patience": patience},
    }
    run = with_keys_of("run", checked(RunConfig, fields, "command line"), keys)
    _check_servos(run, body)
    prepared = ScheduleRun(run, body, with_keys_of("world", load_world(run.world), keys))
    prepared.check_plan()
    return prepared


def prepare_source(
    make: MakeSource,
    *,
    robot: str | None = None,
    world: str | None = None,
    seconds: float = 20.0,
    seed: int = 0,
    name: str = "source",
    keys: Mapping[str, object] | None = None,
) -> SourceRun:
    """Prepare a run of your own motion source, of at most ``seconds``; it ends earlier when done.

    ``make`` takes the robot and returns a fresh source at each call: one is stepped on paper before
    torque is on, another one in the run; ``keys`` as of ``prepare_walk``.

    Raises:
        InputError: the robot lacks joints that the source needs, or its cycle does not fit the
            wire; limits of the joints are checked by ``execute``.

    """
    keys = _checked_keys(keys, _OF_A_SOURCE)
    body = with_keys_of("robot", load_robot(robot or "yaw16"), keys)
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
    run = with_keys_of("run", checked(RunConfig, fields, "prepare_source"), keys)
    _check_servos(run, body)
    ground = with_keys_of("world", load_world(run.world), keys)
    return SourceRun(run, _with_gains(body, pitch=needs.pitch), ground, make)


def prepare_policy(
    name: str,
    *,
    robot: str | None = None,
    world: str | None = None,
    seconds: float = 20.0,
    seed: int = 0,
    keys: Mapping[str, object] | None = None,
) -> SourceRun:
    """Prepare a learnt policy, shipped or of a file; after ``seconds`` it comes to rest.

    Robot and world are by default those that it was learnt on.

    Raises:
        InputError: no such policy, or a robot whose joints it does not know.

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
    """Prepare a run that another program commands, for ``seconds`` at most.

    Pitch joints are set up to carry links, as for gaits; ``keys`` as of ``prepare_walk``.

    Raises:
        InputError: no such robot or world; its cycle does not fit the wire.

    """
    keys = _checked_keys(keys, _OF_A_SOURCE)
    body = with_keys_of("robot", load_robot(robot or "yaw16"), keys)
    fields = {
        "name": name,
        "robot": body.name,
        "world": world or "flat",
        "motion": "source",
        "time_limit_s": seconds,
    }
    run = with_keys_of("run", checked(RunConfig, fields, "command line"), keys)
    _check_servos(run, body)
    ground = with_keys_of("world", load_world(run.world), keys)
    return CommandedRun(run, _with_gains(body, pitch=bool(len(body.pitch_joints))), ground, make)


def check_supply(robot: RobotConfig) -> None:
    """Refuse a supply at which a servo would do nothing but raise its alarm.

    Raises:
        InputError: with the model's range of voltages, and the one that its page recommends.

    """
    for facts in robot.models_by_id.values():
        if facts.motor is None:  # its file does not say
            continue
        low_v, high_v = facts.motor.voltage_v
        if not low_v <= robot.servo.supply_v <= high_v:
            raise InputError(
                f"robot {robot.name}: servo.supply_v = {robot.servo.supply_v:g}: {facts.model} "
                f"takes {low_v:g} to {high_v:g} V; recommended: supply_v = "
                f"{facts.motor.nominal_v:g}"
            )


def _check_servos(run: RunConfig, robot: RobotConfig) -> None:
    """Refuse a wrong supply, a cycle longer than its period, and a current that no servo reaches.

    Raises:
        InputError: with the model's voltages; with the highest rate that fits; with the current at
            which the model stalls.

    """
    check_supply(robot)
    if run.safety.current_limit_a is not None:
        try:
            robot.check_over_current("safety.current_limit_a", run.safety.current_limit_a)
        except ValueError as fault:
            raise InputError(f"run {run.name}: {fault}") from None
    robot_budget(robot, robot.servo.baud, fast=True).check(run.cycle_hz)


def gait_by_name(name: str, parameters: dict[str, Any] | None) -> tuple[Gait, GaitSetConfig | None]:
    """Make a gait by its name or by that of a set of parameters, and return the set."""
    if name in GAITS:
        return make_gait(name, parameters), None
    if not is_gait(name) and not name.endswith(".toml"):
        raise InputError(
            f"{name}: no such gait; there are {', '.join(GAITS)}; "
            f"sets of parameters: {', '.join(shipped('gaits'))}; your own ends in .toml"
        )
    known = load_gait(name)
    return make_gait(known.gait, dict(known.parameters) | (parameters or {})), known


def _with_gains(robot: RobotConfig, *, pitch: bool, soft: Sequence[int] = ()) -> RobotConfig:
    """Set the servos up: pitch joints that carry links, all as soft as the least of ``soft``."""
    servo = robot.servo
    changes: dict[str, float] = {}
    if pitch:
        changes["pitch_p_gain"] = max(servo.pitch_p_gain, servo.position_p_gain)
        carry_a = GAIT_PITCH_SHARE * robot.over_current_a
        changes["pitch_current_limit_a"] = max(servo.pitch_current_limit_a, carry_a)
    if soft:
        changes["position_p_gain"] = changes["pitch_p_gain"] = min(soft)
    joints = []
    for joint, axis in zip(robot.joints, robot.all_axes, strict=False):  # there may be none
        own: dict[str, float | None] = {}
        for key, least in (
            ("position_p_gain", changes.get("pitch_p_gain")),
            ("current_limit_a", changes.get("pitch_current_limit_a")),
        ):
            value = getattr(joint, key)
            if value is not None and least is not None and axis == "p":
                own[key] = max(value, least)
        if soft:
            own["position_p_gain"] = None
        joints.append(joint.model_copy(update=own))
    return robot.model_copy(
        update={"servo": servo.model_copy(update=changes), "joints": tuple(joints)}
    )
