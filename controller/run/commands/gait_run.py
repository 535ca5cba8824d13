"""``snakewalk gait run``: a gait on servos or in the simulator."""

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    VIEW_AT,
    Compliant,
    Film,
    Force,
    Json,
    Robot,
    Ros,
    RunFolder,
    RunPort,
    Set,
    Shadow,
    View,
    ViewAt,
    World,
    key_values,
)
from snakewalk.controller.console.progress import TimeBar, in_real_time
from snakewalk.controller.console.result_files import run_folder
from snakewalk.controller.metrics.displacement import gait_displacement
from snakewalk.controller.run.commands.gait_options import Name, Param, parameters
from snakewalk.controller.run.execute import Finished, execute
from snakewalk.controller.run.factory import prepare_gait, with_compliance
from snakewalk.controller.run.finish import by_evidence, show_run, summarized
from snakewalk.controller.run.hands import Hands, open_hands
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.watchers import watched

Then = Annotated[
    list[str] | None,
    typer.Option(help="NAME@S[,PARAM=V]: change gait after S seconds; may be given again"),
]
By = Annotated[
    str,
    typer.Option(
        help="how gaits change: blend, or cpg: oscillators",
        autocompletion=completion.words("blend", "cpg"),
    ),
]
LookHeading = Annotated[float | None, typer.Option(help="world heading that the head keeps")]
LookAt = Annotated[str | None, typer.Option(help="X,Y in metres: point that the head looks at")]
Live = Annotated[
    bool,
    typer.Option("--live", help="change it as it runs: by keys, with --view in the page"),
]
OnGamepad = Annotated[
    Path | None, typer.Option(help="the same from a gamepad, e.g. /dev/input/js0")
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
    by: By = "blend",
    seconds: Annotated[float, typer.Option(help="then it comes to rest")] = 20.0,
    look_heading_rad: LookHeading = None,
    look_at: LookAt = None,
    live: Live = False,
    gamepad: OnGamepad = None,
    port: RunPort = None,
    compliance: Compliant = None,
    shadow: Shadow = False,
    view: View = False,
    view_at: ViewAt = VIEW_AT,
    ros: Ros = False,
    film: Film = True,
    out: RunFolder = None,
    force: Force = False,
    seed: Annotated[int, typer.Option(help="of every random choice")] = 0,
    as_json: Json = False,
) -> None:
    """Run a gait on servos or in the simulator; leaves a log, a report and a film."""
    if by not in {"blend", "cpg"}:
        raise InputError(f"--by {by}: expected blend or cpg")
    with ExitStack() as stack:
        watchers = stack.enter_context(watched(view, view_at, ros))
        hands = open_hands(stack, live, gamepad, None if watchers is None else watchers.page)
        prepared = prepare_gait(
            name,
            robot=robot,
            world=world,
            parameters=parameters(param),
            seconds=seconds,
            seed=seed,
            look_heading_rad=look_heading_rad,
            look_at_m=_point(look_at),
            make_operator=None if hands is None else hands.operator,
            then=[_change(text) for text in then or []],
            by="cpg" if by == "cpg" else "blend",
            keys=key_values("--set", set_),
        )
        prepared = replace(prepared, run=with_compliance(prepared.run, compliance))
        run = prepared.run
        if hands is not None:
            hands.policy = run.safety.lost_observer
        folder = stack.enter_context(run_folder(f"gait-{run.name}-{prepared.robot.name}", out))
        bar = stack.enter_context(TimeBar(run.name, seconds, _names(prepared, hands)))
        paced = (watchers is not None or prepared.make_operator is not None) and port is None
        on_progress = in_real_time(bar.on_progress) if paced else bar.on_progress
        finished = execute(
            prepared,
            folder,
            port,
            force=force,
            view=watchers,
            shadow=shadow,
            stop_requested=lambda: None if hands is None else hands.torque_off(),
            on_progress=on_progress,
            on_event=bar.on_event,
        )
    show_run(finished, folder, _facts(prepared, finished), as_json, film=film)


def _facts(prepared: GaitRun, finished: Finished) -> dict[str, object]:
    """Return the figures of a run; displacements only of one gait that nobody changed."""
    result: dict[str, object] = {
        "gait": prepared.config.name,
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "duration_s": round(finished.outcome.duration_s, 2),
        "tripped": finished.outcome.tripped,
        "slowed_to": round(finished.outcome.least_rate, 3),
    }
    if prepared.config.then:
        result["then"] = [f"{change.name}@{change.at_s:g}" for change in prepared.config.then]
    if (
        prepared.make_operator is None
        and not prepared.config.then
        and prepared.config.by == "blend"
    ):
        displacement = gait_displacement(finished.record)
        result |= {
            "frequency_hz": round(displacement.frequency_hz, 3),
            "cycles": displacement.cycles,
        }
        moved = {
            "forward_body_lengths_cycle": _digits(displacement.forward_bl),
            "left_body_lengths_cycle": _digits(displacement.left_bl),
            "up_body_lengths_cycle": _digits(displacement.up_bl),
            "turn_rad_cycle": _digits(displacement.turn_rad),
            "speed_m_s": _digits(displacement.speed_m_s),
        }
        result |= by_evidence(finished, moved)
    result |= {
        "electrical_energy_j": finished.summary.electrical_energy_j,
        **summarized(
            finished.summary, "electrical_cost_of_transport", "mechanical_cost_of_transport"
        ),
        "peak_current_a": finished.summary.peak_current_a,
        "peak_temperature_c": finished.summary.peak_temperature_c,
    }
    return result


def _names(prepared: GaitRun, hands: Hands | None) -> Callable[[float], str]:
    """What moves at a time of the run: gaits change by keys or as planned."""
    name = prepared.run.name
    if hands is not None:
        return lambda gone_s: hands.gait or name
    return lambda gone_s: [
        name,
        *(change.name for change in prepared.config.then if change.at_s <= gone_s),
    ][-1]


def _change(text: str) -> tuple[float, str, dict[str, Any]]:
    """Read NAME@SECONDS[,PARAM=VALUE...]."""
    what, *values = text.split(",")
    name, at, seconds = what.rpartition("@")
    try:
        at_s = float(seconds)
    except ValueError:
        at = ""
    if not at or not name:
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


def _digits(value: float) -> float | None:
    return None if math.isnan(value) else round(value, 4)
