"""The page of a run in the process of a test, fed by the same line as the page's process."""

import re
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from snakewalk.config.arrays import Image
from snakewalk.controller.motion.command import Refused
from snakewalk.controller.runlog.row_line import ObserverEnd, RunEnd
from snakewalk.controller.view.browser_gamepad import BrowserGamepad
from snakewalk.controller.view.command_line import fresh_commands
from snakewalk.controller.view.dead_man import DeadMan
from snakewalk.controller.view.fresh_line import Freshness
from snakewalk.controller.view.live_page import _LivePage
from snakewalk.controller.view.live_view import LiveView
from snakewalk.controller.view.operators import OPERATOR_BACK, OPERATOR_LOST
from snakewalk.controller.view.page_server import open_page
from snakewalk.controller.view.stop_element import StopElement


class PageView:
    """The page of a run, in the same thread."""

    def __init__(self) -> None:
        ours, far = socket.socketpair()
        self.end = RunEnd(ours)
        self._picture: bytes | None = None
        self._picture_s = -1.0
        self.now_s = 100.0
        self.is_operator_lost = False
        freshness = Freshness(lambda: self.now_s)
        self.stop = stop = StopElement(freshness)
        self.server, self.url = open_page("127.0.0.1", 0, stop, freshness=freshness)
        self.gamepad = BrowserGamepad(lambda: self.now_s)
        self.dead_man = DeadMan(lambda: self.now_s)
        self.page = _LivePage(self.server, ObserverEnd(far), self.gamepad, stop, freshness)

    def on_course(self) -> None:
        LiveView.on_course(self)  # type: ignore[arg-type]

    def on_row(self, topic: str, row: bytes) -> None:
        LiveView.on_row(self, topic, row)  # type: ignore[arg-type]

    def on_button(self, path: Path) -> None:
        LiveView.on_button(self, path)  # type: ignore[arg-type]

    def on_gait(self, name: str, parameters: dict[str, float], limit: str = "") -> None:
        LiveView.on_gait(self, name, parameters, limit)  # type: ignore[arg-type]

    def on_picture(self, image: Image, time_s: float) -> None:
        LiveView.on_picture(self, image, time_s)  # type: ignore[arg-type]

    is_enabled = property(lambda self: self.dead_man.is_enabled)

    def pressed(self) -> list[str | Refused]:
        lines = [line for line in self.end.commands() if line not in self.operator_lines(line)]
        return fresh_commands(lines, self.dead_man, lambda: self.now_s)

    def operator_lines(self, line: str) -> tuple[str, ...]:
        """Note whether the operator is lost."""
        words = (OPERATOR_LOST, OPERATOR_BACK)
        if line in words:
            self.is_operator_lost = line == OPERATOR_LOST
        return words

    _end = property(lambda self: self.end)

    def close(self) -> None:
        self.server.stop()

    def sent(self) -> Iterator[tuple[str, Any]]:
        """Rows that the page receives when it asks."""
        end = self.page._end
        end.ask()
        self.end.pump()
        return end.rows(1.0)

    def shown(self, what: str) -> str:
        return re.sub("<[^>]*>", " ", getattr(self.page._dashboard, what).content)
