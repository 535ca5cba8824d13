"""Runs of a gait, from a command's options."""

from collections.abc import Mapping, Sequence
from typing import Any

from snakewalk.config.errors import InputError
from snakewalk.config.gait import GaitSetConfig
from snakewalk.config.key_types import MOTION_S
from snakewalk.config.loader import load_gait, load_run, shipped
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.gaits.gait import Gait, fitting_robot
from snakewalk.controller.gaits.registry import BROKEN, GAITS, make_gait
from snakewalk.controller.run.assembly import assemble, load_body
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.run_keys import OF_A_GAIT, checked_keys
from snakewalk.controller.run.servo_setup import with_gains


def gait_keys(keys: Mapping[str, object] | None) -> dict[str, object]:
    """Return keys of run, robot and world for a gait's run, angles in rad.

    Raises:
        InputError: no file has a key, or an option sets it; one line each.

    """
    return checked_keys(keys, OF_A_GAIT)


def prepare_gait(
    name: str,
    *,
    robot: str | None = None,
    world: str | None = None,
    parameters: dict[str, Any] | None = None,
    seconds: float = MOTION_S,
    seed: int = 0,
    then: Sequence[tuple[float, str, dict[str, Any]]] = (),
    keys: Mapping[str, object] | None = None,
) -> GaitRun:
    """Prepare a gait, or a shipped or own set of parameters (``config/gaits``), by name.

    ``then`` contains time, name and parameters of the gaits that follow. ``keys`` replace values of
    run, robot and world as in ``prepare_walk``; ``run.gait.by`` is how the gait changes,
    ``run.gait.look_at_m`` the point that the head looks at.

    Raises:
        InputError: no such gait, parameters out of range, a robot that lacks joints, changes out of
            order.

    """
    keys = gait_keys(keys)
    gait, gait_set = gait_by_name(name, parameters)
    if gait_set is not None:
        robot = robot or gait_set.robot
        world = world or gait_set.world
    changes = [(at_s, gait_by_name(other, values)[0]) for at_s, other, values in then]
    gaits = [gait, *(other for _, other in changes)]
    pitch = any(named_gait.needs.pitch for named_gait in gaits)
    robot_name = robot or fitting_robot(named_gait.needs for named_gait in gaits)
    body = load_body(robot_name, keys)
    for named_gait in gaits:
        named_gait.check(body)
    run, ground = assemble(
        {
            "name": name.removesuffix(".toml").rpartition("/")[2],
            "robot": body.name,
            "world": world or gait.world,
            "motion": "gait",
            "seed": seed,
            "time_limit_s": seconds + (60.0 if keys.get("run.gait.by") == "cpg" else 30.0),
            "gait": {
                "name": gait.name,
                "parameters": gait.params.model_dump(),
                "duration_s": seconds,
                "then": [
                    {"at_s": at_s, "name": g.name, "parameters": g.params.model_dump()}
                    for at_s, g in changes
                ],
            },
            "compliance": gait_set.compliance if gait_set is not None else None,
        },
        keys,
        body,
    )
    soft = [gait.p_gain for gait in gaits if gait.p_gain is not None]
    body = with_gains(body, pitch=pitch, soft=soft)
    prepared = GaitRun(run, body, ground)
    remark = prepared.remark()
    if remark is not None:
        LOGGER.warning("%s", remark)
    return prepared


def is_gait(name: str) -> bool:
    """Whether this is the name of a gait or of a shipped set of its parameters."""
    return name in GAITS or name in shipped("gaits")


def moves_by_gait(name: str) -> bool:
    """Whether this names a gait, or a run that goes along its waypoints by a gait."""
    return is_gait(name) or load_run(name).motion == "gait"


def gait_by_name(name: str, parameters: dict[str, Any] | None) -> tuple[Gait, GaitSetConfig | None]:
    """Make a gait by its name or by that of a set of parameters, and return the set."""
    if name in GAITS or name in BROKEN:
        return make_gait(name, parameters), None
    if not is_gait(name) and not name.endswith(".toml"):
        raise InputError(
            f"{name}: no such gait; there are {', '.join(GAITS)}; "
            f"sets of parameters: {', '.join(shipped('gaits'))}; your own ends in .toml"
        )
    gait_set = load_gait(name)
    return make_gait(gait_set.gait, dict(gait_set.parameters) | (parameters or {})), gait_set
