"""A log in the page: the same scene and panels, with a time slider and play and pause."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np
import viser

from snakewalk.config.errors import InputError
from snakewalk.controller.app.view.dashboard import Dashboard
from snakewalk.controller.app.view.page_server import float_above, open_page
from snakewalk.controller.app.view.scene import BodyScene
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.drivers.clock import Clock

_PERIOD_S: Final = 0.05
_CURVES_S: Final = 0.5
_SPEEDS: Final = ("0.25", "0.5", "1", "2", "5", "10")


class LogPage:
    """The page of one log; ``step`` is called over and over.

    Raises:
        InputError: the log has no control cycle, or nothing can be served there.

    """

    def __init__(self, record: RunRecord, host: str, port: int) -> None:
        if not len(record.cycle.time_s) or not len(record.pose.time_s):
            raise InputError("it ends before the first control cycle: there is nothing to show")
        self._record = record
        try:
            self.server, self.url = open_page(host, port)
        except OSError as fault:
            raise InputError(f"--view-at {host}:{port}: {fault.strerror or fault}") from None
        self._begin_s = float(record.cycle.time_s[0])
        self._end_s = float(record.cycle.time_s[-1])
        panel = self.server.gui.add_panel()
        with panel.add_tab("time"):
            first_s = math.floor(100.0 * self._begin_s) / 100.0
            last_s = max(math.ceil(100.0 * self._end_s) / 100.0, first_s + 0.01)
            self._slider = self.server.gui.add_slider("s", first_s, last_s, 0.01, first_s)
            self._speed = self.server.gui.add_dropdown("speed", _SPEEDS, initial_value="1")
            self._play = self.server.gui.add_button("play  (Space)", icon=viser.Icon.PLAYER_PLAY)
        float_above(panel)
        self._play.on_click(lambda event: self.toggle())
        self.server.gui.add_command("play or pause", hotkey="space").on_trigger(
            lambda event: self.toggle()
        )
        self._scene = BodyScene(self.server, record.header)
        self._scene.first_camera(self.server)
        self._dashboard = Dashboard(self.server, record.header)
        self.playing = False
        self.time_s = self._begin_s
        self._drawn: tuple[object, ...] = ()
        self._curves_s = -np.inf

    def toggle(self) -> None:
        """Play, or pause; at the end it begins again."""
        self.playing = not self.playing
        if self.playing and self.time_s >= self._end_s:
            self.time_s = self._begin_s
            self._slider.value = self.time_s  # type: ignore[misc]  # viser's stub
        self._play.label = "pause  (Space)" if self.playing else "play  (Space)"

    def step(self, dt_s: float, now_s: float) -> None:
        """Go on by ``dt_s`` of real time and draw what has changed."""
        if abs(self._slider.value - self.time_s) > 0.02:  # somebody has moved it
            self.time_s = float(self._slider.value)
        elif self.playing:
            self.time_s = min(self.time_s + dt_s * float(self._speed.value), self._end_s)
            self._slider.value = round(self.time_s, 2)  # type: ignore[misc]
            if self.time_s >= self._end_s:
                self.toggle()
        board = self._dashboard
        state = (self.time_s, board.follow.value, board.goals.value, board.joint.value)
        if state != self._drawn:
            curves = now_s - self._curves_s >= _CURVES_S or not self.playing
            self._curves_s = now_s if curves else self._curves_s
            self._drawn = state
            self._draw(curves=curves)

    def _draw(self, *, curves: bool) -> None:
        record, time_s = self._record, self.time_s
        cycle, pose = _row(record.cycle.time_s, time_s), _row(record.pose.time_s, time_s)
        slow = _row(record.slow.time_s, time_s) if len(record.slow.time_s) else None
        events = tuple(each for each in record.events if each.time_s <= time_s + 1e-9)
        board, follow = self._dashboard, self._dashboard.follow.value
        with self.server.atomic():
            if not follow:
                self._scene.release()
            self._scene.show(record, cycle, pose, follow=follow, goals=board.goals.value)
            board.show_state(record, cycle, pose, record.note)
            board.show_servos(record, cycle, slow)
            if curves:
                self._scene.show_paths(record.paths, time_s)
                self._scene.show_trail(record.pose.centre_m[: pose + 1])
                board.show_curves(record, cycle, pose)
                board.show_events(events)


def play(page: LogPage, clock: Clock, stopped: Callable[[], bool] = lambda: False) -> None:
    """Serve a log until ``stopped()``, or an interrupt."""
    before_s = clock.now_s()
    while not stopped():
        clock.sleep_until_s(before_s + _PERIOD_S)
        now_s = clock.now_s()
        page.step(now_s - before_s, now_s)
        before_s = now_s


def _row(time_s: np.ndarray, at_s: float) -> int:
    """Index of the newest row at a time."""
    return max(int(np.searchsorted(time_s, at_s, side="right")) - 1, 0)
