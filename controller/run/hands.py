"""Devices by which an operator changes a gait during its run."""

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import cast

from rich.columns import Columns

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.console.gamepad import Gamepad
from snakewalk.controller.console.keyboard import Keyboard
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.plain_console import PlainConsole
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.operator import KEYS, Operator
from snakewalk.controller.run.observer_watch import ADVICE
from snakewalk.controller.run.watchers import PageControls
from snakewalk.controller.runtime.drive import OnEvent


class Hands:
    """Devices of an operator: keyboard, gamepad, page."""

    def __init__(
        self, devices: list[Keyboard | Gamepad | PageControls], page: PageControls | None
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
        """Name of the chosen gait; None before the run."""
        return None if self._motion is None else self._motion.gait.name

    def torque_off(self) -> str | None:
        """Reason for torque off, requested in every read and write; it stays."""
        for device in self._devices:
            self._waiting += device.pressed()
        self._off = self._off or "t" in self._waiting
        return "the operator switched torque off" if self._off else self._lost_device()

    def _lost_device(self) -> str | None:
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

    def operator(self, motion: GaitMotion, robot: RobotConfig, on_event: OnEvent) -> Operator:
        """Let the pressed keys command a motion."""

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
        return all(device.is_enabled for device in self._devices)


def open_hands(
    stack: ExitStack, live: bool, gamepad: Path | None, page: PageControls | None
) -> Hands | None:
    """Open the operator's devices and print their functions; None without an operator."""
    if not live and gamepad is None:
        return None
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
    return Hands(devices, page)
