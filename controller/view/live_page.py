"""The process that serves a run's page: rows in, viser out, and the stop button pressed."""

import json
import os
import signal
import socket
import sys
from collections import defaultdict, deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Event
from typing import Any

import viser

from snakewalk.config.plain_text import plain
from snakewalk.controller.metrics.verdict import RunVerdict
from snakewalk.controller.runlog.record import Header, RunRecord
from snakewalk.controller.runlog.row_line import (
    BUTTON,
    COURSE,
    GAIT,
    PICTURE,
    VERDICT,
    ObserverEnd,
)
from snakewalk.controller.runlog.tables import record_of
from snakewalk.controller.runlog.topics import (
    ConfigTable,
    CycleTable,
    EventTable,
    PoseSourceTable,
    PoseTable,
    SlowTable,
    WaypointTable,
)
from snakewalk.controller.view.browser_gamepad import BrowserGamepad
from snakewalk.controller.view.command_line import timed
from snakewalk.controller.view.dashboard import SPAN_S, Dashboard
from snakewalk.controller.view.fresh_line import Freshness
from snakewalk.controller.view.gait_panel import GaitPanel
from snakewalk.controller.view.gamepad_panel import GamepadPanel
from snakewalk.controller.view.operators import OPERATOR_BACK, OPERATOR_LOST
from snakewalk.controller.view.page_server import open_page
from snakewalk.controller.view.scene import BodyScene
from snakewalk.controller.view.stop_element import StopElement
from snakewalk.controller.view.waypoint_panel import WaypointPanel
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.priority import give_way
from snakewalk.drivers.safety.stop_button import PressedButton

_PERIOD_S = 0.05
"""Time between two drawings of the body."""
_SERVOS_S = 0.2
_CURVES_S = 0.5
_SILENT_S = 0.5
"""A run that sends nothing for this time may have ended."""
_LAST_S = 3.0
"""Longest time for the end or the report to reach the browsers, or for a reload (ours)."""
_ROWS = round(SPAN_S / _PERIOD_S)


def serve(line: socket.socket, host: str, port: int) -> None:
    """Serve a page until the run closes the line."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    command = os.getppid()
    sys.stdout = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115  viser prints
    give_way()
    try:
        gamepad = BrowserGamepad()
        freshness = Freshness()
        stop = StopElement(freshness)
        server, url = open_page(host, port, gamepad, stop, freshness=freshness)
    except OSError as fault:
        line.sendall(json.dumps({"fault": str(fault)}).encode() + b"\n")
        return
    line.sendall(json.dumps({"url": url}).encode() + b"\n")
    page = _LivePage(server, ObserverEnd(line), gamepad, stop, freshness)
    with suppress(EOFError):
        while True:
            try:
                page.step()
            except EOFError:
                raise
            except Exception as fault:  # the E-STOP stays
                page.report(fault)
    is_over = Event()
    signal.signal(signal.SIGTERM, lambda *_: is_over.set())  # when the command ends
    server.flush()
    page.end(lambda: is_over.is_set() or os.getppid() != command)
    server.stop()


class _LivePage:
    """State of the page between two steps."""

    def __init__(
        self,
        server: viser.ViserServer,
        end: ObserverEnd,
        gamepad: BrowserGamepad,
        stop: StopElement,
        freshness: Freshness,
    ) -> None:
        self._server = server
        self._end = end
        self._gamepad = gamepad
        gamepad.on_stop = lambda: self._stop.show(self._press("E-STOP of a gamepad"))
        self._gamepad_panel: GamepadPanel | None = None
        self._clock = WallClock()
        self._stop = stop
        self._freshness = freshness
        stop.press = self._press
        self._collected_s = freshness.now_s()
        self._button: PressedButton | None = None
        self._rows: dict[str, deque[dict[str, Any]]] = defaultdict(lambda: deque(maxlen=_ROWS))
        server.gui.add_html("")  # keeps viser's own settings away until there are panels
        self._header: Header | None = None
        self._scene: BodyScene | None = None
        self._dashboard: Dashboard | None = None
        self._gait_panel: GaitPanel | None = None
        self._gait: dict[str, Any] | None = None
        self._waypoint_panel: WaypointPanel | None = None
        self._takes_waypoints = False
        self._over = False
        self._report: Path | None = None
        self._are_lost = False
        self._faults: set[str] = set()
        self._asked_s = self._told_s = self._servos_s = self._curves_s = -1.0

    def step(self) -> None:
        """Read the rows that have come, draw them, and request more."""
        now_s = self._clock.now_s()
        if self._asked_s < self._told_s or self._asked_s < 0.0:
            self._clock.sleep_until_s(self._asked_s + _PERIOD_S)
            self._asked_s = self._clock.now_s()
            self._end.ask()
            self._send_commands()
        for topic, row in self._end.rows(_PERIOD_S):
            self._store_row(topic, row)
            if topic == PoseTable.topic.name:
                self._told_s = self._clock.now_s()
                self._stop.newest_s = self._freshness.now_s()
                self._draw()
        if self._button is not None and now_s - max(self._told_s, 0.0) > _SILENT_S:
            ended = self._button.end
            if ended is not None and not self._over:
                self._over = True
                self._stop.ended(ended)

    def end(self, is_over: Callable[[], bool]) -> None:
        """Serve until the browsers have the end of the run, and its report if it has one.

        The report is drawn after the run, up to ``is_over``.
        """
        until_s = self._clock.now_s() + _LAST_S
        is_due = self._report is not None
        while self._clock.now_s() < until_s and (is_due or not self._stop.is_shown):
            self._clock.sleep_until_s(self._clock.now_s() + _PERIOD_S)
            if self._report is not None:
                self._stop.offer(self._report)
            is_due = is_due and not is_over()
            if is_due and self._stop.has_browsers:
                until_s = self._clock.now_s() + _LAST_S

    def report(self, fault: Exception) -> None:
        text = " ".join(
            f"page: it cannot show everything ({fault or type(fault).__name__})".split()
        )
        if text not in self._faults:
            self._faults.add(text)
            print(f"snakewalk: {plain(text)}", file=sys.stderr, flush=True)

    def _send_commands(self) -> None:
        """Send inputs with the earliest time at which they can have begun."""
        since_s = min(self._collected_s, self._freshness.take())
        self._collected_s = self._freshness.now_s()
        commands = self._commands()
        if commands:
            self._stop.operators.note_command()
        for command in commands:
            self._end.command(timed(command, since_s))
        are_lost = self._stop.operators.are_lost()
        if are_lost != self._are_lost:
            self._are_lost = are_lost
            self._end.command(OPERATOR_LOST if are_lost else OPERATOR_BACK)
        for late_s in self._stop.late_s():
            self._end.command(timed("an input", late_s))

    def _commands(self) -> list[str]:
        """Inputs that were set in the page since the last call."""
        commands = []
        if self._gait_panel is not None:
            commands += self._gait_panel.commands(self._asked_s) + self._gamepad.commands()
        if self._waypoint_panel is not None:
            commands += self._waypoint_panel.commands()
        if self._gamepad_panel is not None:
            self._gamepad_panel.show(steers=self._gait_panel is not None)
            commands += self._gamepad_panel.commands()
        return commands

    def _store_row(self, topic: str, row: dict[str, Any]) -> None:
        if topic == BUTTON:
            self._button = PressedButton(Path(row["path"]))
            self._stop.arm()
            return
        if topic == ConfigTable.topic.name:
            self._open_run(record_of({topic: [row]}, complete=False, note="").header)
            return
        if topic in (PICTURE, VERDICT):
            self._show(topic, row)
            return
        if topic == GAIT:
            self._gait = row
            self._show_gait()
            return
        if topic == COURSE:
            self._takes_waypoints = True
            self._take_waypoints()
            return
        if topic == WaypointTable.topic.name:
            self._header = self._record({topic: [row]}).header
            return
        self._rows[topic].append(row)
        if topic == EventTable.topic.name:
            self._take_event(row["kind"], row["text"])

    def _show(self, topic: str, row: dict[str, Any]) -> None:
        if self._dashboard is None:
            return
        if topic == PICTURE:
            self._dashboard.show_picture(row["jpeg"])
        else:
            verdict = RunVerdict(**row)
            self._dashboard.show_verdict(verdict)
            self._report = None if verdict.report is None else Path(verdict.report)
            report = "" if verdict.report is None else f"; report: {verdict.report}"
            self._stop.judged(f"{verdict.text} ({verdict.evidence}){report}")

    def _open_run(self, header: Header) -> None:
        """Draw the body of a run that begins, and its panels."""
        self._header = header
        with self._server.atomic():
            self._scene = BodyScene(self._server, header)
            self._scene.first_camera()
            self._dashboard = Dashboard(self._server, header, self._scene.switches)
        self._show_gait()
        self._take_waypoints()
        self._gamepad_panel = GamepadPanel(self._server, self._dashboard.tabs, self._gamepad)

    def _take_event(self, kind: str, text: str) -> None:
        if kind in ("trip", "interrupt") or (kind == "stop" and not self._over):
            self._over = True
            self._stop.ended(text)
        if self._dashboard is not None:
            topic = EventTable.topic.name
            events = {topic: list(self._rows[topic])}
            self._dashboard.show_events(self._record(events).events)
        if self._waypoint_panel is not None:
            self._waypoint_panel.show(kind, text)

    def _show_gait(self) -> None:
        if self._gait is None or self._header is None or self._dashboard is None:
            return
        if self._gait_panel is None:
            self._gait_panel = GaitPanel(self._server, self._dashboard.tabs, self._header.robot)
        self._gait_panel.show(**self._gait)

    def _take_waypoints(self) -> None:
        """Accept clicks on the ground, once it is drawn; only if the run's waypoints may be set."""
        if self._takes_waypoints and self._scene is not None and self._dashboard is not None:
            self._waypoint_panel = WaypointPanel(self._server, self._dashboard.tabs, self._scene)

    def _draw(self) -> None:
        scene = self._scene
        dashboard = self._dashboard
        now_s = self._told_s
        if scene is None or dashboard is None:
            return
        tables = (CycleTable, PoseTable, SlowTable, PoseSourceTable)
        newest = {table.topic.name: [*self._rows[table.topic.name]][-1:] for table in tables}
        now = self._record(newest)
        with self._server.atomic():
            follow = dashboard.follow.value
            if not follow:
                scene.release()
            scene.show(now, -1, -1, follow=follow, goals=dashboard.goals.value)
            if now_s - self._servos_s >= _SERVOS_S:
                self._servos_s = now_s
                dashboard.show_state(now, -1, -1, "")
                dashboard.show_servos(now, -1, -1 if len(now.slow.time_s) else None)
            if now_s - self._curves_s >= _CURVES_S:
                self._curves_s = now_s
                past = self._record(
                    {topic: list(rows_of_topic) for topic, rows_of_topic in self._rows.items()}
                )
                dashboard.show_curves(past, len(past.cycle.time_s) - 1)
                scene.show_paths(past.paths, float(past.cycle.time_s[-1]))
                scene.show_trail(past.pose.centre_m)

    def _record(self, rows: dict[str, list[dict[str, Any]]]) -> RunRecord:
        return record_of(rows, complete=False, note="", header=self._header)

    def _press(self, sender: str) -> str:
        if self._button is None:
            return "no run has begun yet"
        self._button.press(sender)
        return "stop requested"
