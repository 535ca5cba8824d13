"""One log or two in the page: the same scene and panels, with a time slider, play and pause."""

import math
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
import viser

from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import surface
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.metrics.verdict import verdict
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.view.dashboard import Dashboard
from snakewalk.controller.view.page_server import float_above, served_page
from snakewalk.controller.view.scene import BodyScene
from snakewalk.drivers.clock import Clock

_PERIOD_S = 0.05
_CURVES_S = 0.5
_GAP_M = 0.5
"""Gap between the grounds of two logs (ours)."""
_SPEEDS = ("0.25", "0.5", "1", "2", "5", "10")


class LogPage:
    """The page of a log, or of two; ``step`` is called over and over.

    Two begin together. They lie on one ground if it is the same, else, or if asked, side by side.

    Args:
        records: of one or two logs, by the names that the page gives them.
        host: that the page is served at.
        port: 0 for any that is free.
        repeats: whether it begins again at the end.

    Raises:
        InputError: a log has no control cycle, or nothing can be served there.

    """

    def __init__(
        self, records: Mapping[str, RunRecord], host: str, port: int, *, repeats: bool = False
    ) -> None:
        for name, record in records.items():
            if not len(record.cycle.time_s) or not len(record.pose.time_s):
                raise InputError(
                    f"{name}: it ends before the first control cycle: there is nothing to show"
                )
        self.server, self.url = served_page(host, port)
        first = next(iter(records.values()))
        self._begin_s = _begin_s(first)
        longest_s = max(
            float(log_record.cycle.time_s[-1]) - _begin_s(log_record)
            for log_record in records.values()
        )
        self._end_s = self._begin_s + longest_s
        gui = self.server.gui
        panel = gui.add_panel()
        with panel.add_tab("time"):
            first_s = math.floor(100.0 * self._begin_s) / 100.0
            last_s = max(math.ceil(100.0 * self._end_s) / 100.0, first_s + 0.01)
            self._slider = gui.add_slider("s", first_s, last_s, 0.01, first_s)
            self._speed = gui.add_dropdown("speed", _SPEEDS, initial_value="1")
            self._play = gui.add_button("play  (Space)", icon=viser.Icon.PLAYER_PLAY)
            self._apart: viser.GuiCheckboxHandle | None = None
            if len(records) > 1:
                self._is_same_world = (
                    len({log_record.header.world for log_record in records.values()}) == 1
                )
                self._apart = gui.add_checkbox("side by side", not self._is_same_world)
        float_above(panel)
        self._play.on_click(lambda event: self.toggle())
        gui.add_command("play or pause", hotkey="space").on_trigger(lambda event: self.toggle())
        tabs = gui.add_tab_group() if len(records) > 1 else None
        self._shown = []
        for number, (name, record) in enumerate(records.items()):
            scene = BodyScene(self.server, record.header, number)
            with nullcontext() if tabs is None else tabs.add_tab(name):
                board = Dashboard(self.server, record.header, scene.switches)
            if not board.checks_pose:
                board.show_verdict(verdict(record, summary(record)))
            self._shown.append(_ShownLog(record, scene, board))
        self._shown[0].scene.first_camera()
        self.playing = False
        self._repeats = repeats
        self.time_s = self._begin_s
        self._curves_s = -np.inf
        self._is_apart: bool | None = None

    def toggle(self) -> None:
        """Play, or pause; at the end it begins again."""
        self.playing = not self.playing
        if self.playing and self.time_s >= self._end_s:
            self.time_s = self._begin_s
            self._slider.value = self.time_s  # type: ignore[misc]  # viser's stub
        self._play.label = "pause  (Space)" if self.playing else "play  (Space)"

    def step(self, dt_s: float, now_s: float) -> None:
        """Advance by ``dt_s`` of real time and draw the changes."""
        if abs(self._slider.value - self.time_s) > 0.02:  # a user has moved it
            self.time_s = float(self._slider.value)
        elif self.playing:
            self.time_s = min(self.time_s + dt_s * float(self._speed.value), self._end_s)
            self._slider.value = round(self.time_s, 2)  # type: ignore[misc]
            if self.time_s >= self._end_s:
                self.toggle()
                if self._repeats:
                    self.toggle()
        curves = now_s - self._curves_s >= _CURVES_S or not self.playing
        self._curves_s = now_s if curves else self._curves_s
        moved = self._lay_out()
        with self.server.atomic():
            for shown_log in self._shown:
                shown_log.draw(self.time_s - self._begin_s, curves=curves, again=moved)

    def _lay_out(self) -> bool:
        """Put the second log next to the first, or onto it; return whether that has changed."""
        if self._apart is None:
            return False
        distance_m = self._apart.value
        other = self._shown[1].scene
        if distance_m == self._is_apart:
            return False
        self._is_apart = distance_m
        right_m, left_m = (_sides_m(shown_log.record)[k] for k, shown_log in enumerate(self._shown))
        other.aside_m = np.array([0.0, right_m - left_m - _GAP_M if distance_m else 0.0, 0.0])
        flat = all(shown_log.record.header.ground is None for shown_log in self._shown)
        other.hide_ground(flat or (self._is_same_world and not distance_m))
        return True


@dataclass(slots=True)
class _ShownLog:
    """A log in the page."""

    record: RunRecord
    scene: BodyScene
    board: Dashboard
    drawn: tuple[object, ...] = ()

    def draw(self, since_s: float, *, curves: bool, again: bool = False) -> None:
        record = self.record
        board = self.board
        scene = self.scene
        at_s = min(_begin_s(record) + since_s, float(record.cycle.time_s[-1]))
        state = (at_s, board.follow.value, board.goals.value, board.joint.value)
        if state == self.drawn and not again:
            return
        self.drawn = state
        cycle = _row(record.cycle.time_s, at_s)
        pose = _row(record.pose.time_s, at_s)
        slow = _row(record.slow.time_s, at_s) if len(record.slow.time_s) else None
        follow = board.follow.value
        if not follow:
            scene.release()
        scene.show(record, cycle, pose, follow=follow, goals=board.goals.value)
        board.show_state(record, cycle, pose, record.note)
        board.show_servos(record, cycle, slow)
        if curves:
            scene.show_paths(record.paths, at_s)
            scene.show_trail(record.pose.centre_m[: pose + 1])
            board.show_curves(record, cycle)
            board.show_events(
                tuple(event for event in record.events if event.time_s <= at_s + 1e-9)
            )


def _sides_m(record: RunRecord) -> tuple[float, float]:
    """Least and greatest y of a log's ground; on a flat one of where the body was and should be."""
    if record.header.ground is None:
        drawn = [record.pose.centre_m[:, 1], *(points_m[:, 1] for _, points_m in record.paths)]
        y_m = np.concatenate(drawn)
    else:
        y_m = surface(record.header.ground)[0][:, 1]
    return float(np.nanmin(y_m)), float(np.nanmax(y_m))


def _begin_s(record: RunRecord) -> float:
    return float(record.cycle.time_s[0])


def play(page: LogPage, clock: Clock, stopped: Callable[[], bool] = lambda: False) -> None:
    """Serve a log until ``stopped()``, or an interrupt."""
    before_s = clock.now_s()
    while not stopped():
        clock.sleep_until_s(before_s + _PERIOD_S)
        now_s = clock.now_s()
        page.step(now_s - before_s, now_s)
        before_s = now_s


def _row(time_s: np.ndarray, at_s: float) -> int:
    return max(int(np.searchsorted(time_s, at_s, side="right")) - 1, 0)
