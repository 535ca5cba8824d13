"""``snakewalk gait run``: a gait on servos or in the simulator."""

import math
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.gamepad import Gamepad
from snakewalk.controller.console.keyboard import Keyboard
from snakewalk.controller.console.messages import LOGGER
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
from snakewalk.controller.console.plain_console import PlainConsole
from snakewalk.controller.console.progress import TimeBar, in_real_time
from snakewalk.controller.console.result_files import run_folder
from snakewalk.controller.metrics.displacement import gait_displacement
from snakewalk.controller.motion.operator import KEYS, Operator
from snakewalk.controller.run.commands.gait_options import Name, Param, parameters
from snakewalk.controller.run.execute import execute
from snakewalk.controller.run.factory import prepare_gait, with_compliance
from snakewalk.controller.run.finish import by_evidence, costs_of_transport, show_run
from snakewalk.controller.run.observer_watch import ADVICE
from snakewalk.controller.run.watchers import watched

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig
    from snakewalk.controller.console.gamepad import Gamepad
    from snakewalk.controller.console.keyboard import Keyboard
    from snakewalk.controller.motion.gait_motion import GaitMotion
    from snakewalk.controller.motion.operator import Operator
    from snakewalk.controller.run.kinds.gait_run import GaitRun
    from snakewalk.controller.run.watchers import PageControls
    from snakewalk.controller.runtime.drive import OnEvent


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
    then: Annotated[
        list[str] | None,
        typer.Option(help="NAME@S[,PARAM=V]: change gait after S seconds; may be given again"),
    ] = None,
    by: Annotated[
        str,
        typer.Option(
            help="how gaits change: blend, or cpg: oscillators",
            autocompletion=completion.words("blend", "cpg"),
        ),
    ] = "blend",
    seconds: Annotated[float, typer.Option(help="then it comes to rest")] = 20.0,
    look_heading_rad: Annotated[
        float | None, typer.Option(help="world heading that the head keeps")
    ] = None,
    look_at: Annotated[
        str | None, typer.Option(help="X,Y in metres: point that the head looks at")
    ] = None,
    live: Annotated[
        bool,
        typer.Option("--live", help="change it as it runs: by keys, with --view in the page"),
    ] = False,
    gamepad: Annotated[
        Path | None, typer.Option(help="the same from a gamepad, e.g. /dev/input/js0")
    ] = None,
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
        hands = _hands(stack, live, gamepad, None if watchers is None else watchers.page)
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
    if prepared.make_operator is None and not prepared.config.then and by == "blend":
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
        **costs_of_transport(finished.summary),
        "peak_current_a": finished.summary.peak_current_a,
        "peak_temperature_c": finished.summary.peak_temperature_c,
    }
    show_run(finished, folder, result, as_json, film=film)


class _Hands:
    """What an operator has in hand: keyboard, gamepad, page."""

    def __init__(
        self, devices: "list[Keyboard | Gamepad | PageControls]", page: "PageControls | None"
    ) -> None:
        self._devices = devices
        self._page = page
        self._waiting: list[str] = []
        self._off = False
        self._motion: GaitMotion | None = None
        self._lost: str | None = None
        self.policy = "stop"
        """``safety.lost_observer`` of the run."""

    @property
    def gait(self) -> str | None:
        """Name of the gait that they have chosen; None before the run."""
        return None if self._motion is None else self._motion.gait.name

    def torque_off(self) -> str | None:
        """Why torque goes off, asked by the safe link in every read and write; it stays so."""
        for device in self._devices:
            self._waiting += device.pressed()
        self._off = self._off or "t" in self._waiting
        return "the operator switched torque off" if self._off else self._lost_device()

    def _lost_device(self) -> str | None:
        """Return which device with a torque-off key is gone; only warn if the run says so."""
        local = [
            cast("Keyboard | Gamepad", each) for each in self._devices if each is not self._page
        ]
        gone = [device.gone for device in local if device.gone is not None]
        if not gone:
            return None
        if self.policy == "stop":
            return f"{gone[0]}; {ADVICE}"
        if self._lost is None:
            self._lost = gone[0]
            LOGGER.warning("%s; the run goes on (safety.lost_observer)", gone[0])
        return None

    def operator(
        self, motion: "GaitMotion", robot: "RobotConfig", on_event: "OnEvent"
    ) -> "Operator":
        """Put the keys that were pressed in charge of a motion."""

        def on_change(kind: str, text: str) -> None:
            on_event(kind, text)
            tell_page()

        def tell_page() -> None:
            if self._page is not None:
                self._page.on_gait(motion.gait.name, motion.gait.params.model_dump())

        self._motion = motion
        tell_page()
        return Operator(motion, robot, self._take, on_change, self._held)

    def _take(self) -> list[str]:
        taken, self._waiting = self._waiting, []
        return taken

    def _held(self) -> bool:
        """Whether nobody who has a dead man's button has let it go."""
        return all(device.held for device in self._devices)


def _hands(
    stack: ExitStack, live: bool, gamepad: Path | None, page: "PageControls | None"
) -> _Hands | None:
    """Open what an operator has in hand, and say what it does; None without an operator."""
    if not live and gamepad is None:
        return None
    from rich.columns import Columns  # noqa: PLC0415

    devices: list[Keyboard | Gamepad | PageControls] = []
    keys: list[str] = []
    if page is not None:
        devices.append(page)
    if live and (page is None or sys.stdin.isatty()):
        devices.append(stack.enter_context(Keyboard()))
        keys += [f"{key}: {what}" for key, what in KEYS.items()]
    if gamepad is not None:
        devices.append(stack.enter_context(Gamepad(gamepad)))
        keys += ["hold LB or RB: it moves", "right stick pressed: torque off"]
    PlainConsole(stderr=True, highlight=False).print(Columns([*keys, "Ctrl-C: torque off"]))
    return _Hands(devices, page)


def _names(prepared: "GaitRun", hands: _Hands | None) -> Callable[[float], str]:
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
