"""Devices by which an operator changes a gait during its run.

A gamepad through Linux's joystick interface (``/dev/input/js0``): eight bytes per event.

``struct js_event``: time in ms (u32), value (i16), type (u8: 1 button, 2 axis, 0x80 at the start),
number (u8); Documentation/input/joydev/joystick-api.rst of the kernel.
"""

import os
import select
import stat
import struct
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Self, cast

from rich.columns import Columns

from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.plain_console import PlainConsole
from snakewalk.controller.motion.command import LATE_S, Refused
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.operator import KEYS, Operator
from snakewalk.controller.motion.refusals import NAME_MAX
from snakewalk.controller.run.observers import ADVICE, PageControls
from snakewalk.controller.runtime.drive import OnEvent

_EVENT = struct.Struct("<IhBB")
_BUTTON = 1
_AXIS = 2
_AT_START = 0x80
_HALF_DEFLECTION = 16384
_EVENTS_MAX = 8
"""Reads of 64 events in a call (ours): a device that never ends must not hold a cycle up."""
BUTTONS = {0: "n", 1: "m", 2: "p", 3: "d", 6: "space", 7: "q", 8: "space", 9: "q", 10: "t"}
"""A, B, X, Y, select and start of common pads; 10 is the right stick pressed, or the middle one."""
DEAD_MAN = (4, 5)
"""Buttons of the dead man's switch: the shoulder buttons, left and right."""
AXES = {0: ("left", "right"), 1: ("up", "down"), 6: ("left", "right"), 7: ("up", "down")}
"""Left stick and cross: the names at the low and at the high end."""


class Pad:
    """Converts events to key names; a stick counts once each time it leaves the middle."""

    def __init__(self) -> None:
        self._rest = b""
        self._out: dict[int, int] = {}
        self._down: set[int] = set()

    @property
    def is_enabled(self) -> bool:
        """Whether a dead man's button is held."""
        return bool(self._down)

    def keys(self, data: bytes) -> list[str]:
        """Key names of ``data``, any number of bytes."""
        pressed: list[str] = []
        data = self._rest + data
        complete_bytes = len(data) - len(data) % _EVENT.size
        self._rest = data[complete_bytes:]
        for _, value, kind, number in _EVENT.iter_unpack(data[:complete_bytes]):
            if kind & ~_AT_START == _BUTTON and number in DEAD_MAN:
                (self._down.add if value else self._down.discard)(number)
            elif kind == _BUTTON and value and number in BUTTONS:
                pressed.append(BUTTONS[number])
            elif kind & ~_AT_START == _AXIS and number in AXES:
                side = int(value > _HALF_DEFLECTION) - int(value < -_HALF_DEFLECTION)
                if side and side != self._out.get(number, 0) and not kind & _AT_START:
                    pressed.append(AXES[number][side > 0])
                self._out[number] = side
        return pressed


class Gamepad:
    """The device, as a context manager."""

    def __init__(self, path: Path) -> None:
        try:
            self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise InputError(f"{path}: {error.strerror or error}: no gamepad to read") from None
        if stat.S_ISREG(os.fstat(self._file).st_mode):
            os.close(self._file)
            raise InputError(f"{path}: is a file, not a gamepad; name one such as /dev/input/js0")
        self._path = path
        self._pad = Pad()
        self._gone = self._is_written = False

    @property
    def gone(self) -> str | None:
        """Reason why its buttons fail, or None."""
        return f"{self._path}: the gamepad is gone, and its E-STOP with it" if self._gone else None

    @property
    def is_enabled(self) -> bool:
        """Whether a shoulder button is held; False for a lost pad."""
        return self._pad.is_enabled and not self._gone

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        os.close(self._file)

    def pressed(self) -> list[str]:
        """Names of the keys pressed since the last call."""
        data = b""
        try:
            for _ in range(_EVENTS_MAX):
                more = os.read(self._file, 512)
                data += more
                if not more:
                    # a pipe has no end before its first writer comes
                    self._gone = self._gone or self._is_written
                    break
                self._is_written = True
        except BlockingIOError:
            return self._pad.keys(data)
        except OSError:  # unplugged, or out of radio range
            self._gone = True
        return self._pad.keys(data)


try:
    import termios
    import tty
except ImportError:  # Windows
    termios = tty = None  # type: ignore[assignment]

_NAMES = {
    "\x1b[A": "up",
    "\x1b[B": "down",
    "\x1b[C": "right",
    "\x1b[D": "left",
    "\x1bOA": "up",
    "\x1bOB": "down",
    "\x1bOC": "right",
    "\x1bOD": "left",
    " ": "space",
    "k": "up",
    "j": "down",
    "l": "right",
    "h": "left",
}

_READS_MAX = 16
"""Reads of 256 characters in a call (ours): pasted text must not hold a cycle up."""


def names(text: str) -> list[str]:
    """Names of the keys in terminal characters; arrows are three characters each."""
    keys: list[str] = []
    position = 0
    while position < len(text):
        arrow = _NAMES.get(text[position : position + 3])
        if arrow is not None and text[position] == "\x1b":
            keys.append(arrow)
            position += 3
            continue
        if text[position] != "\x1b":
            keys.append(_NAMES.get(text[position], text[position]))
        position += 1
    return keys


class Keyboard:
    """A terminal in cbreak mode, as a context manager."""

    is_enabled = True
    """A keyboard has no dead man's button."""

    def __init__(self, descriptor: int | None = None) -> None:
        if termios is None:
            raise InputError("--live: reads keys on Linux and macOS only; use --view here")
        self._file = sys.stdin.fileno() if descriptor is None else descriptor
        if not os.isatty(self._file):
            raise InputError(
                "--live: reads keys from a terminal, but standard input is not a "
                "terminal; use --view"
            )
        self._before = termios.tcgetattr(self._file)
        self.gone: str | None = None
        """Why keys do not arrive any more, or None."""

    def __enter__(self) -> Self:
        tty.setcbreak(self._file)
        return self

    def __exit__(self, *raised: object) -> None:
        termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)

    def pressed(self) -> list[str]:
        """Names of the keys pressed since the last call."""
        text = b""
        for _ in range(_READS_MAX):
            if self.gone is not None or not select.select([self._file], [], [], 0.0)[0]:
                break
            try:
                more = os.read(self._file, 256)
            except OSError:
                more = b""
            text += more
            if not more:
                self.gone = "keyboard: the terminal is closed, and its torque-off key with it"
        return names(text.decode(errors="ignore"))


_ENDS = ("q", "t")
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
        """Action if the observer is lost (``safety.lost_observer`` of the run)."""

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
            report_gait()

        def report_gait() -> None:
            if self._page is not None:
                self._page.on_gait(
                    motion.gait.name, motion.gait.params.model_dump(), motion.limit or ""
                )

        self._motion = motion
        report_gait()
        return Operator(motion, robot, self._take_keys, on_change, self._is_enabled_by_hand)

    def _take_keys(self) -> list[str | Refused]:
        """Return the keys; late ones, other than for the end, as a reason why they are dropped."""
        taken = self._waiting
        self._waiting = []
        now_s = self._now_s()
        return [
            key
            if now_s - since_s <= LATE_S or key in _ENDS
            else _late_refusal(key, now_s - since_s)
            for since_s, key in taken
        ]

    def _is_enabled_by_hand(self) -> bool:
        return all(device.is_enabled for device in self._devices)


def _late_refusal(key: str | Refused, age_s: float) -> Refused:
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
