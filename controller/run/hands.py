"""Devices by which an operator changes a gait during its run."""

import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Final, cast

from rich.columns import Columns

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.console.gamepad import Gamepad
from snakewalk.controller.console.keyboard import Keyboard
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.plain_console import PlainConsole
from snakewalk.controller.motion.command import LATE_S, Refused
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.operator import KEYS, Operator
from snakewalk.controller.motion.refusals import NAME_MAX
from snakewalk.controller.run.observers import ADVICE, PageControls
from snakewalk.controller.runtime.drive import OnEvent

_ENDS: Final = ("q", "t")
"""Keys that are never too late."""


class Hands:
    """Devices of an operator: keyboard, gamepad, page."""

    def __init__(
        self,
        devices: list[Keyboard | Gamepad | PageControls],
        page: PageControls | None,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._devices = devices
        self._page = page
        self._now_s = now_s
        self._polled_s: float | None = None
        self._waiting: list[tuple[float, str | Refused]] = []
        """Earliest time and key of each press that the motion has not received."""
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
        now_s = self._now_s()
        since_s = now_s if self._polled_s is None else self._polled_s
        self._polled_s = now_s
        for device in self._devices:
            keys = device.pressed()
            self._waiting += [(since_s, key) for key in keys]
            self._off = self._off or "t" in keys
        return "the operator switched torque off" if self._off else self._lost_device()

    def _lost_device(self) -> str | None:
        local = [
            cast("Keyboard | Gamepad", device)
            for device in self._devices
            if device is not self._page
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

    def _take(self) -> list[str | Refused]:
        """Return the keys; late ones, other than for the end, as a reason why they are dropped."""
        taken = self._waiting
        self._waiting = []
        now_s = self._now_s()
        return [
            key if now_s - since_s <= LATE_S or key in _ENDS else _late(key, now_s - since_s)
            for since_s, key in taken
        ]

    def _held(self) -> bool:
        return all(device.is_enabled for device in self._devices)


def _late(key: str | Refused, age_s: float) -> Refused:
    if isinstance(key, Refused):
        return key
    return Refused(
        f"{key[:NAME_MAX]} came up to {age_s:.1f} s late and is dropped; at most {LATE_S:g} s is "
        "accepted; press it again"
    )


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
