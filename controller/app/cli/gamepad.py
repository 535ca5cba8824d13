"""A gamepad through Linux's joystick interface (``/dev/input/js0``): eight bytes an event.

``struct js_event``: time in ms (u32), value (i16), type (u8: 1 button, 2 axis, 0x80 at the start),
number (u8); Documentation/input/joydev/joystick-api.rst of the kernel.
"""

import os
import struct
from pathlib import Path
from types import TracebackType
from typing import Self

from snakewalk.config.errors import InputError

_EVENT = struct.Struct("<IhBB")
_BUTTON, _AXIS, _AT_START = 1, 2, 0x80
_HALF = 16384
BUTTONS = {0: "n", 1: "m", 2: "p", 3: "d", 6: "space", 7: "q", 8: "space", 9: "q"}
"""A, B, X, Y, select and start of common pads."""
AXES = {0: ("left", "right"), 1: ("up", "down"), 6: ("left", "right"), 7: ("up", "down")}
"""Left stick and cross: the names at the low and at the high end."""


class Pad:
    """Makes key names of events; a stick counts once each time it leaves the middle."""

    def __init__(self) -> None:
        self._rest = b""
        self._out: dict[int, int] = {}

    def keys(self, data: bytes) -> list[str]:
        """Names of the keys that ``data`` (any number of bytes) means."""
        found: list[str] = []
        data = self._rest + data
        whole = len(data) - len(data) % _EVENT.size
        self._rest = data[whole:]
        for _, value, kind, number in _EVENT.iter_unpack(data[:whole]):
            if kind == _BUTTON and value and number in BUTTONS:
                found.append(BUTTONS[number])
            elif kind & ~_AT_START == _AXIS and number in AXES:
                side = int(value > _HALF) - int(value < -_HALF)
                if side and side != self._out.get(number, 0) and not kind & _AT_START:
                    found.append(AXES[number][side > 0])
                self._out[number] = side
        return found


class Gamepad:
    """The device; use as a context manager."""

    def __init__(self, path: Path) -> None:
        try:
            self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise InputError(f"{path}: {error.strerror or error}: no gamepad to read") from None
        self._pad = Pad()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.close(self._file)

    def pressed(self) -> list[str]:
        """Names of the keys pressed since the last call."""
        data = b""
        try:
            while more := os.read(self._file, 512):
                data += more
        except BlockingIOError:
            return self._pad.keys(data)
        return self._pad.keys(data)
