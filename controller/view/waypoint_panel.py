"""Waypoints set by a click on the ground, in the page of a live walk."""

from collections.abc import Callable
from html import escape
from queue import SimpleQueue

import viser

from snakewalk.config import colours
from snakewalk.controller.view.scene import BodyScene
from snakewalk.controller.walk.live_course import ADD, CLEAR, END, NEXT

_HINT = "Shift and a click on the ground add a waypoint, too"


class WaypointPanel:
    """A tab of buttons; a click commands the run, which reports its result."""

    def __init__(
        self, server: viser.ViserServer, tabs: viser.GuiTabGroupHandle, scene: BodyScene
    ) -> None:
        self._scene = scene
        self._commands: SimpleQueue[str] = SimpleQueue()
        self._armed = ""
        gui = server.gui
        with tabs.add_tab("walk"):
            for word, label, what in (
                (ADD, "add a waypoint", "the next click on the ground is the last waypoint"),
                (NEXT, "go there next", "the next click on the ground is the only waypoint left"),
            ):
                gui.add_button(label, hint=what).on_click(self._arming(word))
            gui.add_button(
                "omit the remaining waypoints",
                hint="the body comes to rest, and waits for a waypoint",
            ).on_click(self._commanding(CLEAR))
            self._text = gui.add_html("")
            gui.add_button(
                "end the run", color="gray", hint="the body comes to rest, then torque goes off"
            ).on_click(self._commanding(END))
        self._show(_HINT)
        server.scene.on_click()(self._on_click)
        server.scene.on_click(modifier="shift")(self._on_click)

    def commands(self) -> list[str]:
        """Clicks since the last call, for a ``LiveCourse``."""
        result = []
        while not self._commands.empty():
            result.append(self._commands.get())
        return result

    def show(self, kind: str, text: str) -> None:
        """Show the event of the log that answers a click."""
        if kind in ("operator", "refused"):
            self._show(text, colours.FAULT if kind == "refused" else "inherit")

    def _arming(self, word: str) -> Callable[[object], None]:
        """Callback of a button that waits for a click, or stops waiting."""

        def pressed(event: object) -> None:
            self._armed = "" if self._armed == word else word
            self._show("now click on the ground" if self._armed else _HINT)

        return pressed

    def _commanding(self, word: str) -> Callable[[object], None]:
        def pressed(event: object) -> None:
            self._armed = ""
            self._commands.put(word)

        return pressed

    def _on_click(self, event: viser.SceneClickEvent) -> None:
        word = ADD if event.modifier == "shift" else self._armed
        self._armed = ""
        if not word:
            return
        point_m = self._scene.ground_m(event.ray_origin, event.ray_direction)
        if point_m is None:
            self._show("refused: you did not click on the ground", colours.FAULT)
            return
        self._commands.put(f"{word}={point_m[0]:.3f},{point_m[1]:.3f}")
        self._show("requested from the run")

    def _show(self, text: str, color: str = "inherit") -> None:
        style = f"padding:.2em .8em .6em;font-size:13px;color:{color}"
        self._text.content = f"<div style='{style}'>{escape(text)}</div>"
