"""A gamepad at the computer of the page's user.

viser does not support gamepads. A script in the page sends the state to a socket behind the gate,
at changes and ten times a second, and only after the last state was received.
"""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

from websockets.exceptions import ConnectionClosed

from snakewalk.config.archive import parse_json
from snakewalk.controller.motion.command import LATE_S
from snakewalk.controller.view.dead_man import STALE_S, hold_command

KEYS = {0: "n", 1: "m", 2: "p", 3: "d", 8: "space", 9: "q"} | {
    12: "up",
    13: "down",
    14: "left",
    15: "right",
}
"""A, B, X, Y, select, start and cross of the standard gamepad (w3.org/TR/gamepad) to the keys of an
``Operator``."""
STICK = (("left", "right"), ("up", "down"))
"""Left stick: the keys at the low and at the high end of its axes."""
DEAD_MAN = (4, 5)
"""Buttons of the dead man's switch: the shoulder buttons, left and right."""
STOP = (11, 16)
"""Stop buttons: the right stick pressed, and the button in the middle."""
_HALF_DEFLECTION = 0.5
_MESSAGE_BYTES = 2000
_MESSAGES_S = 100
"""More messages in a second cannot come from our script: its line is closed (ours)."""
_KEYS_MAX = 100
PATH = "/gamepad"
"""Path of the socket."""
_PERIOD_MS, _KEEP_MS, _AGAIN_MS = 20, 100, 2000


SCRIPT = f"""(() => {{
  let socket = null, waiting = false, last = "", sent = 0;
  const open = () => {{
    const line = new WebSocket(location.origin.replace(/^http/, "ws") + "{PATH}");
    socket = line; waiting = false; last = "";
    line.onmessage = () => {{ waiting = false; tell(); }};
    line.onclose = () => setTimeout(() => {{ socket = null; }}, {_AGAIN_MS});
  }};
  const state = () => {{
    // a page that is not seen gets no news of its gamepads
    const all = document.hidden || !navigator.getGamepads ? [] : [...navigator.getGamepads()];
    const pads = all.filter((pad) => pad && pad.connected);
    const pad = pads.find((each) => each.mapping === "standard") || pads[0];
    return JSON.stringify(!pad ? null : {{
      name: pad.id.slice(0, 80),
      mapping: pad.mapping,
      axes: pad.axes.slice(0, {len(STICK)}).map((value) => Math.round(10 * value) / 10),
      buttons: pad.buttons.slice(0, 24).map((button) => button.pressed ? 1 : 0),
    }});
  }};
  const tell = () => {{
    const now = state();
    if (!socket) {{
      if (now !== "null") open();
      return;
    }}
    const same = now === last && performance.now() - sent < {_KEEP_MS};
    if (socket.readyState !== 1 || waiting || same) return;
    socket.send(now);
    waiting = true; last = now; sent = performance.now();
  }};
  setInterval(tell, {_PERIOD_MS});
  document.addEventListener("visibilitychange", tell);
}})();"""
"""Script in the page that reads the gamepad."""


@dataclass(frozen=True, slots=True)
class PadState:
    """A gamepad at one time."""

    name: str
    standard: bool
    """Whether the browser knows which of its buttons is which."""
    pressed: frozenset[int]
    sides: tuple[int, ...]
    """State of each axis: -1, 0 or 1."""

    @property
    def is_enabled(self) -> bool:
        """Whether a dead man's button is down."""
        return not self.pressed.isdisjoint(DEAD_MAN)


def read_state(message: str | bytes) -> PadState | None:
    """Read what the script sent; None where the browser has no gamepad.

    Raises:
        ValueError: it is nothing that the script sends.

    """
    if len(message) > _MESSAGE_BYTES:
        raise ValueError("too long")
    row = parse_json(message)
    if row is None:
        return None
    try:
        axes = [float(value) for value in row["axes"][: len(STICK)]]
        pressed = frozenset(k for k, down in enumerate(row["buttons"]) if down == 1)
        name = str(row["name"])
        standard = row["mapping"] == "standard"
    except (TypeError, KeyError, ArithmeticError) as fault:
        raise ValueError("no state of a gamepad") from fault
    if not all(math.isfinite(value) for value in axes):
        raise ValueError("no number")
    if not standard:
        return PadState(name, False, frozenset(), ())
    sides = tuple(int(value > _HALF_DEFLECTION) - int(value < -_HALF_DEFLECTION) for value in axes)
    return PadState(name, True, pressed, sides)


class _Source:
    """One browser."""

    def __init__(self) -> None:
        self.state: PadState | None = None
        self.times_s: deque[float] = deque(maxlen=_MESSAGES_S)


class BrowserGamepad:
    """The steering gamepad among all browsers with the page; any of them may stop.

    The threads of the page's server call ``take`` and ``leave``.
    """

    path = PATH
    script = SCRIPT

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._lock = threading.Lock()
        self._sources: dict[Hashable, _Source] = {}
        self._steers: Hashable | None = None
        self._told_s = -math.inf
        self._is_new = False
        self._keys: deque[str] = deque(maxlen=_KEYS_MAX)
        self.state: PadState | None = None
        """Last state of the gamepad that steers."""
        self.on_stop: Callable[[], None] = lambda: None
        """Function that is called from any thread when a stop button is pressed."""

    @property
    def is_stale(self) -> bool:
        """Whether the steering gamepad has stopped responding."""
        return self._now_s() - self._told_s > STALE_S

    @property
    def _is_unclaimed(self) -> bool:
        return self._steers is None or self.is_stale

    def take(self, source: Hashable, message: str | bytes, since_s: float | None = None) -> bool:
        """Process a message from a browser; return whether its line may stay open.

        A message that began at ``since_s`` and is late may only stop the run.
        """
        now_s = self._now_s()
        is_late = since_s is not None and now_s - since_s > LATE_S
        with self._lock:
            browser = self._sources.setdefault(source, _Source())
            times_s = browser.times_s
            if len(times_s) == _MESSAGES_S and now_s - times_s[0] < 1.0:
                return False
            times_s.append(now_s)
            try:
                state = read_state(message)
            except ValueError:
                return False
            before = browser.state
            browser.state = state
            was_down = before.pressed if before is not None else frozenset[int]()
            stops = state is not None and not (state.pressed - was_down).isdisjoint(STOP)
            is_first = state is not None and self._is_unclaimed
            if not is_late and (source == self._steers or is_first):
                self._keys += _pressed_keys(before, state)
                self._steers = source if state is not None else None
                self.state = state
                self._told_s = now_s
                self._is_new = True
        if stops:
            self.on_stop()
        return True

    def leave(self, source: Hashable) -> None:
        """Forget a browser that has gone."""
        with self._lock:
            self._sources.pop(source, None)
            if source == self._steers:
                self._steers = None
                self.state = None
                self._is_new = True

    def commands(self) -> list[str]:
        """Keys pressed since the last call; then, if a state has come, whether it is held."""
        with self._lock:
            page_commands = list(self._keys)
            self._keys.clear()
            if self._is_new:
                self._is_new = False
                is_held = self.state is not None and self.state.is_enabled
                page_commands.append(hold_command(is_held, self._told_s))
        return page_commands

    async def serve(self, connection: Any) -> None:
        """Process the messages of one browser, one after another, until it leaves."""
        try:
            async for message in connection:
                if not self.take(connection, message, connection.beginnings_s.popleft()):
                    break
                await connection.send("taken")
        except ConnectionClosed:
            pass
        finally:
            self.leave(connection)


def _pressed_keys(before: PadState | None, state: PadState | None) -> list[str]:
    """Keys that a change means: a button that is down when a gamepad is first seen does not count.

    A stick counts once each time it leaves the middle.
    """
    if before is None or state is None:
        return []
    keys = [KEYS[k] for k in sorted(state.pressed - before.pressed) if k in KEYS]
    for names, was, side in zip(STICK, before.sides, state.sides, strict=False):
        if side and side != was:
            keys.append(names[side > 0])
    return keys
