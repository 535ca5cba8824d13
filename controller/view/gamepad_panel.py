"""Text about a gamepad at the computer of the page's user, and how to do without."""

from html import escape
from queue import SimpleQueue

import viser

from snakewalk.controller.view.browser_gamepad import BrowserGamepad
from snakewalk.controller.view.dead_man import WITHOUT

_NO_GAMEPAD = (
    "No gamepad. Press a button of a gamepad at the computer of this browser; the browser "
    "reports it only then."
)
_STOP = "right stick pressed: E-STOP"


class GamepadPanel:
    """A tab of the page."""

    def __init__(
        self,
        server: viser.ViserServer,
        tabs: viser.GuiTabGroupHandle,
        gamepad: BrowserGamepad,
    ) -> None:
        self._gamepad = gamepad
        self._pressed: SimpleQueue[str] = SimpleQueue()
        self._needed = False
        self._shown = ""
        with tabs.add_tab("gamepad"):
            self._text = server.gui.add_html("")
            self._without = server.gui.add_button(
                "go on without the gamepad", hint="no button has to be held", visible=False
            )
        self._without.on_click(lambda event: self._pressed.put(WITHOUT))
        self.show(steers=False)

    def show(self, *, steers: bool) -> None:
        """Show what the gamepad does: it stops the run, and where that is so steers it."""
        state = self._gamepad.state
        stale = self._gamepad.is_stale
        if state is None:
            text = (
                _NO_GAMEPAD
                if not self._needed
                else "The gamepad is gone: the body holds its shape."
            )
        elif not state.standard:
            text = (
                f"{state.name}: this browser does not know which button is which, so it is ignored."
            )
        elif not steers:
            text = f"{state.name}: {_STOP}."
        else:
            self._needed = True
            now = (
                "The gamepad does not respond: the body holds its shape."
                if stale
                else "Held: the body moves."
                if state.is_enabled
                else "Button released: the body holds its shape."
            )
            text = f"{state.name}: the body moves while LB or RB is held; {_STOP}. {now}"
        if text != self._shown:
            self._shown = text
            self._text.content = f"<div style='padding:.2em .8em .6em'>{escape(text)}</div>"
        missing = self._needed and (state is None or stale)
        if self._without.visible != missing:
            self._without.visible = missing

    def commands(self) -> list[str]:
        """Buttons that were pressed in the tab since the last call."""
        pad_commands = []
        while not self._pressed.empty():
            pad_commands.append(self._pressed.get())
            self._needed = False
        return pad_commands
