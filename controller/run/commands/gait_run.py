"""``snakewalk gait run``: a gait on servos or in the simulator."""

from collections.abc import Callable
from contextlib import ExitStack, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.key_types import BLEND, MOTION_S, SEED, GaitChangeMethod, MotionSeconds, Seed
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Compliant, Robot, Set, Shadow, World, key_values
from snakewalk.controller.console.progress import TimeBar
from snakewalk.controller.console.rounding import rounded
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.metrics.displacement import gait_displacement
from snakewalk.controller.run.commands.gait_options import Name, Param, parameters
from snakewalk.controller.run.hands import Hands, open_hands
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.request import RunResult
from snakewalk.controller.run.results import by_evidence, run_facts, show_result, summarized
from snakewalk.controller.run.run_for_user import observers_of, run_for_user
from snakewalk.controller.run.run_keys import with_compliance

Then = Annotated[
    list[str] | None,
    typer.Option(help="NAME@S[,PARAM=V]: change to gait NAME after S seconds; may be repeated"),
]
LookHeading = Annotated[
    float | None, typer.Option(help="world heading that the head keeps, in rad")
]
LookAt = Annotated[str | None, typer.Option(help="X,Y in metres: point that the head looks at")]
Live = Annotated[
    bool,
    typer.Option("--live", help="change the motion by keys, or in the page with --view"),
]
OnGamepad = Annotated[
    Path | None, typer.Option(help="change the motion with a gamepad, e.g. /dev/input/js0")
]


@command(
    "gait run",
    examples=(
        "gait run sidewinding --param lift_rad=0.15 --seconds 10",
        "gait run lateral-undulation --robot yaw16 --live",
        "gait run rolling --port /dev/ttyUSB0",
    ),
)
def run_gait(
    name: Name,
    robot: Robot = None,
    world: World = None,
    param: Param = None,
    set_: Set = None,
    then: Then = None,
    by: GaitChangeMethod = BLEND,
    seconds: MotionSeconds = MOTION_S,
    look_heading_rad: LookHeading = None,
    look_at: LookAt = None,
    live: Live = False,
    gamepad: OnGamepad = None,
    compliance: Compliant = None,
    shadow: Shadow = False,
    seed: Seed = SEED,
    *,
    options: RunOptions,
) -> None:
    """Run a gait on servos or in the simulator; leaves a log, a report and a film."""
    if (live or gamepad is not None) and (then or by == "cpg"):
        raise InputError("--live changes gaits by keys and joins: leave out --then and --by cpg")
    set_options = key_values("--set", set_) or {}
    given = {
        "run.gait.look_heading_rad": look_heading_rad,
        "run.gait.look_at_m": _point(look_at),
        "run.gait.by": by,
    }
    with ExitStack() as stack:
        observers = stack.enter_context(observers_of(options))
        hands = open_hands(stack, live, gamepad, observers.page)
        gait = prepare_gait(
            name,
            robot=robot,
            world=world,
            parameters=parameters(param),
            seconds=seconds,
            seed=seed,
            then=[_change(text) for text in then or []],
            keys=set_options | {key: value for key, value in given.items() if value is not None},
        )
        prepared = replace(
            gait,
            run=with_compliance(gait.run, compliance),
            make_operator=None if hands is None else hands.operator,
        )
        if hands is not None:
            hands.policy = prepared.run.safety.lost_observer
        result = run_for_user(
            prepared,
            f"gait-{prepared.run.name}-{prepared.robot.name}",
            options,
            bar=TimeBar(prepared.run.name, seconds, _names(prepared, hands)),
            observers=nullcontext(observers),
            shadow=shadow,
            stop_requested=None if hands is None else hands.torque_off,
        )
        with result.ending.noted():  # the observers need up to seconds to close
            stack.close()
    show_result(result, _facts(prepared, result), options)


def _facts(prepared: GaitRun, result: RunResult) -> dict[str, object]:
    facts: dict[str, object] = {
        "gait": prepared.config.name,
        **run_facts(result),
        "lowest_rate": round(result.outcome.least_rate, 3),
    }
    if prepared.config.then:
        facts["then"] = [f"{change.name}@{change.at_s:g}" for change in prepared.config.then]
    if (
        prepared.make_operator is None
        and not prepared.config.then
        and prepared.config.by == "blend"
    ):
        displacement = result.travel.gait or gait_displacement(result.record)
        facts |= {
            "frequency_hz": round(displacement.frequency_hz, 3),
            "cycles_between_ramps": displacement.cycles,
        }
        moved = {
            "forward_body_lengths_cycle": rounded(displacement.forward_bl, 4),
            "left_body_lengths_cycle": rounded(displacement.left_bl, 4),
            "up_body_lengths_cycle": rounded(displacement.up_bl, 4),
            "turn_rad_cycle": rounded(displacement.turn_rad, 4),
            "speed_m_s": rounded(displacement.speed_m_s, 4),
        }
        facts |= by_evidence(result, moved)
    facts |= {
        "electrical_energy_j": result.summary.electrical_energy_j,
        **summarized(
            result.summary, "electrical_cost_of_transport", "mechanical_cost_of_transport"
        ),
        "peak_current_a": result.summary.peak_current_a,
        "peak_temperature_c": result.summary.peak_temperature_c,
    }
    return facts


def _names(prepared: GaitRun, hands: Hands | None) -> Callable[[float], str]:
    name = prepared.run.name
    if hands is not None:
        return lambda gone_s: hands.gait or name
    return lambda gone_s: [
        name,
        *(change.name for change in prepared.config.then if change.at_s <= gone_s),
    ][-1]


def _change(text: str) -> tuple[float, str, dict[str, Any]]:
    what, *values = text.split(",")
    name, when_text, seconds = what.rpartition("@")
    try:
        at_s = float(seconds)
    except ValueError:
        when_text = ""
    if not when_text or not name:
        raise InputError(f"--then {text}: expected NAME@SECONDS[,PARAM=VALUE...]")
    return at_s, name, parameters(values)


def _point(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--look-at {text}: expected X,Y in metres") from None
    return x, y
