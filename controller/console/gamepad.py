"""A gamepad through Linux's joystick interface (``/dev/input/js0``): eight bytes per event.

``struct js_event``: time in ms (u32), value (i16), type (u8: 1 button, 2 axis, 0x80 at the start),
number (u8); Documentation/input/joydev/joystick-api.rst of the kernel.
"""

import os
import stat
import struct
from pathlib import Path
from typing import Self

from snakewalk.config.errors import InputError

_EVENT = struct.Struct("<IhBB")
_BUTTON = 1
_AXIS = 2
_AT_START = 0x80
_HALF = 16384
_READS_MAX = 8
"""Reads of 64 events in a call (ours): a device that never ends must not hold a cycle up."""
BUTTONS = {0: "n", 1: "m", 2: "p", 3: "d", 6: "space", 7: "q", 8: "space", 9: "q", 10: "t"}
"""A, B, X, Y, select and start of common pads; 10 is the right stick pressed, or the middle one."""
DEAD_MAN = (4, 5)
"""The shoulder buttons, left and right."""
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
                side = int(value > _HALF) - int(value < -_HALF)
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
            raise InputError(f"{path}: is a file; a gamepad is such as /dev/input/js0")
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
            for _ in range(_READS_MAX):
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
