"""The gait that an operator runs, in the page: which one, and a slider for each parameter."""

import math
from collections.abc import Callable
from html import escape
from queue import SimpleQueue
from typing import Any

import viser

from snakewalk.config import colours
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.units import label_and_unit
from snakewalk.controller.gaits.gait import Range, ranges
from snakewalk.controller.gaits.registry import GAITS, make_gait
from snakewalk.controller.motion.refusals import NAME_MAX

_EVERY_S = 0.2
"""A slider that is drawn along commands no more often (ours)."""
_SETTLING_S = 1.0
"""An input shows the run's value this time after its last change: also a refusal (ours)."""
_LAST = 1e9
"""Place in the tab below all inputs: no slip of the finger ends the run."""
_BUTTONS = {"halt, go on": "space", "defaults": "d"}
"""Keys of an ``Operator``."""


class GaitPanel:
    """A tab of inputs. The inputs command the run, and show the gait that runs."""

    def __init__(
        self, server: viser.ViserServer, tabs: viser.GuiTabGroupHandle, robot: RobotConfig
    ) -> None:
        """Add the tab; the gaits to choose from are those that suit ``robot``."""
        self._gui = server.gui
        self._moved: SimpleQueue[tuple[str, str]] = SimpleQueue()
        self._waiting: dict[str, str] = {}
        self._moved_s: dict[str, float] = {}
        self._now_s = self._sent_s = 0.0
        self._name, self._values = "", dict[str, Any]()
        self._inputs: dict[str, Any] = {}
        self._folder: viser.GuiFolderHandle | None = None
        self._tab = tabs.add_tab("gait")
        with self._tab:
            names = tuple(name for name in GAITS if _suits(name, robot))
            self._gait = self._gui.add_dropdown("gait", names)
            self._limit = self._gui.add_html("")
            buttons = self._gui.add_button_group("", tuple(_BUTTONS))
            end = self._gui.add_button("end the run", color="gray", order=_LAST)
        end.on_click(lambda event: self._moved.put(("q", "")))
        self._gait.on_update(self._command_of("gait"))
        buttons.on_click(lambda event: self._moved.put((_BUTTONS[event.target.value], "")))

    def show(self, name: str, parameters: dict[str, Any], limit: str = "") -> None:
        """Show what runs: the gait's name, its parameters, and a limit of the joints."""
        changed = name != self._name
        self._name = name
        self._values = parameters
        self._limit.content = (
            f"<div style='padding:0 .8em;color:{colours.FAULT}'>{escape(limit)}</div>"
        )
        if changed:
            self._collect()
            self._waiting.clear()  # they were of another gait
            self._moved_s.clear()
            self._build()
        self._settle()

    def commands(self, now_s: float) -> list[str]:
        """Inputs that were set since the last call, the newest value of each; call it often."""
        self._now_s = now_s
        self._collect()
        late = {name for name, at_s in self._moved_s.items() if now_s - at_s >= _SETTLING_S}
        if late:
            self._moved_s = {k: at_s for k, at_s in self._moved_s.items() if k not in late}
            self._settle()
        if not self._waiting or now_s - self._sent_s < _EVERY_S:
            return []
        self._sent_s = now_s
        taken = self._waiting
        self._waiting = {}
        return [f"{name}={value}" if value else name for name, value in taken.items()]

    def _build(self) -> None:
        if self._folder is not None:
            self._folder.remove()
        with self._tab:
            self._folder = self._gui.add_folder(self._name)
        with self._folder:
            spans = ranges(make_gait(self._name).model)
            self._inputs = {name: self._input(name, span) for name, span in spans.items()}
        for name, shown in self._inputs.items():
            shown.on_update(self._command_of(name))

    def _input(self, name: str, span: Range) -> Any:
        value = _shown_value(self._values[name])
        hint = span.description or None
        label = ", ".join(filter(None, label_and_unit(name)))
        if span.kind is bool:
            return self._gui.add_checkbox(label, bool(value), hint=hint)
        wide = span.high - span.low
        step = 1 if span.kind is int else 10.0 ** math.floor(math.log10(wide / 100.0))
        return self._gui.add_slider(label, span.low, span.high, step, value, hint=hint)

    def _command_of(self, name: str) -> Callable[[Any], None]:
        """Callback for a change of an input, by a browser and not by ``show``."""

        def moved(event: Any) -> None:
            if event.client_id is None:
                return
            value = event.target.value
            if name == "gait":
                self._moved.put((name, str(value)[:NAME_MAX]))
            elif isinstance(value, int | float):
                self._moved.put((name, f"{value:g}"))

        return moved

    def _collect(self) -> None:
        """Collect the values that browsers have set, which their threads put."""
        while not self._moved.empty():
            name, value = self._moved.get()
            self._waiting[name] = value
            self._moved_s[name] = self._now_s

    def _settle(self) -> None:
        """Let all inputs that nobody is moving show what runs."""
        self._collect()
        current_values = {
            "gait": self._name,
            **{k: _shown_value(value) for k, value in self._values.items()},
        }
        for name, shown in {"gait": self._gait, **self._inputs}.items():
            if name not in self._moved_s and shown.value != current_values[name]:
                shown.value = current_values[name]


def _shown_value(value: Any) -> Any:
    """A number with as many digits as fit next to its slider."""
    return round(value, 4) if isinstance(value, float) else value


def _suits(name: str, robot: RobotConfig) -> bool:
    try:
        make_gait(name).check(robot)
    except InputError:
        return False
    return True
