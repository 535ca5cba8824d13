"""From a gait's name and parameters to a job: a robot set up for it, changes of gait, checks."""

from collections.abc import Sequence
from typing import Any, Literal

from snakewalk.config.errors import InputError
from snakewalk.config.gait import GaitSetConfig
from snakewalk.config.loader import checked, load_gait, load_robot, load_world, shipped
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.app.runs.prepared_gait import Live, PreparedGait
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.gaits.registry import GAITS, make_gait
from snakewalk.drivers.bus.budget import wire_budget

GAIT_PITCH_CURRENT_A = 1.5
"""Goal current of the pitch joints in a gait that lifts: soft ones would not carry the links."""


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
    live: Live | None = None,
    then: Sequence[tuple[float, str, dict[str, Any]]] = (),
    by: Literal["blend", "cpg"] = "blend",
) -> PreparedGait:
    """Prepare a gait, or a shipped or own set of parameters (``config/gaits``), by name.

    ``then`` holds (time, name, parameters) of what it changes to, ``by`` how.

    Raises:
        InputError: no such gait, parameters out of range, a robot that lacks joints, changes out of
            order or together with an operator.

    """
    if live is not None and (then or by == "cpg"):
        raise InputError("--live changes gaits by keys and joins: leave out --then and --by cpg")
    gait, known = _named(name, parameters)
    if known is not None:
        robot, world = robot or known.robot, world or known.world
    later = [(at_s, _named(other, values)[0]) for at_s, other, values in then]
    all_gaits = [gait, *(other for _, other in later)]
    pitch = any(each.needs.pitch for each in all_gaits)
    body = load_robot(robot or ("alternating16" if pitch else "yaw16"))
    for each in all_gaits:
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
                    for at_s, g in later
                ],
                "by": by,
            },
        },
        "command line",
    )
    wire_budget(body.joint_count, body.servo.baud, fast=True, slow_read_bytes=7).check(run.cycle_hz)
    return PreparedGait(run, _tuned(body, all_gaits), load_world(run.world), live)


def _named(name: str, parameters: dict[str, Any] | None) -> tuple[Gait, GaitSetConfig | None]:
    """Make a gait by its name or that of a set of parameters, and return the set."""
    if name in GAITS:
        return make_gait(name, parameters), None
    if name not in shipped("gaits") and not name.endswith(".toml"):
        raise InputError(
            f"{name}: no such gait; there are {', '.join(GAITS)}; "
            f"sets of parameters: {', '.join(shipped('gaits'))}; your own ends in .toml"
        )
    known = load_gait(name)
    return make_gait(known.gait, dict(known.parameters) | (parameters or {})), known


def _tuned(robot: RobotConfig, gaits: Sequence[Gait]) -> RobotConfig:
    """Set servos up for the gaits: pitch joints that carry links, all of them softer if asked."""
    servo = robot.servo
    changes: dict[str, float] = {}
    if any(gait.needs.pitch for gait in gaits):
        changes["pitch_p_gain"] = max(servo.pitch_p_gain, servo.position_p_gain)
        changes["pitch_current_limit_a"] = max(servo.pitch_current_limit_a, GAIT_PITCH_CURRENT_A)
    soft = [gait.p_gain for gait in gaits if gait.p_gain is not None]
    if soft:
        changes["position_p_gain"] = changes["pitch_p_gain"] = min(soft)
    return robot.model_copy(update={"servo": servo.model_copy(update=changes)})
