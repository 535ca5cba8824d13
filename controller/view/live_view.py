"""A run's page: served by a process of its own, which is fed with the rows of the log."""

import base64
import json
import math
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.console.command import plugin
from snakewalk.controller.motion.command import Refused
from snakewalk.controller.run.observer_process import ObserverProcess
from snakewalk.controller.runlog.row_line import COURSE, GAIT, PICTURE, SILENT_S
from snakewalk.controller.runlog.topics import PoseTable
from snakewalk.controller.view.command_line import fresh_commands
from snakewalk.controller.view.dead_man import DeadMan
from snakewalk.controller.view.operators import OPERATOR_BACK, OPERATOR_LOST

_PICTURE_S = 0.5
"""Pictures of a camera are shown no more often (ours)."""
_QUALITY = 70


class LiveView(ObserverProcess):
    """Serves the page; use it in a ``with``.

    Raises:
        InputError: viser is not installed, or nothing can be served there.

    """

    def __init__(self, position: str = "127.0.0.1:8080") -> None:
        require_extra("the page needs", "viser")
        super().__init__(
            _serve, *host_and_port(position), what="page", fault=f"--view-at {position}"
        )
        self.url = str(self.said["url"])
        """Address to open in a browser; contains the token."""
        self._picture: bytes | None = None
        self._picture_s = -math.inf
        self._dead_man = DeadMan()
        self._is_operator_lost = False

    def __exit__(self, *raised: object) -> None:
        """End the run's line; the page ends when the browsers have the report, or this program."""
        self._end.close(0.5)

    @property
    def is_enabled(self) -> bool:
        """Whether the dead man's button of a browser's gamepad is held; True without a gamepad."""
        return self._dead_man.is_enabled

    def pressed(self) -> list[str | Refused]:
        """Inputs set in the page since the last call, for an ``Operator`` or a ``LiveCourse``."""
        lines = []
        for line in self._end.commands():
            if line in (OPERATOR_LOST, OPERATOR_BACK):
                self._is_operator_lost = line == OPERATOR_LOST
            else:
                lines.append(line)
        return fresh_commands(lines, self._dead_man, time.monotonic)

    def lost(self, now_s: float) -> str | None:
        """Return why its E-STOP has failed, or None."""
        why = super().lost(now_s)
        if why is None and self._is_operator_lost:
            return (
                f"page: the browser that steers has not answered for {SILENT_S:g} s, "
                "so its E-STOP may not work"
            )
        return why

    def on_gait(self, name: str, parameters: dict[str, float], limit: str = "") -> None:
        """Show in the page the sliders of the gait that an operator runs."""
        row = {"name": name, "parameters": parameters, "limit": limit}
        self._end.add(GAIT, json.dumps(row).encode())

    def on_course(self) -> None:
        """Let the page accept clicks: the run's waypoints may be set."""
        self._end.add(COURSE, b"{}")

    def on_row(self, topic: str, row: bytes) -> None:
        """Accept a row of the log; returns at once."""
        if topic == PoseTable.topic.name and self._picture is not None:
            picture = self._picture
            self._picture = None
            self._end.add(PICTURE, picture)
        self._end.add(topic, row)

    def on_picture(self, image: Image, time_s: float) -> None:
        """Accept a picture (H, W, 3), blue first, of the run's camera, from its thread."""
        if time_s - self._picture_s < _PICTURE_S:
            return
        import cv2  # noqa: PLC0415  an extra

        self._picture_s = time_s
        is_encoded, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        if is_encoded:
            shown = base64.b64encode(data.tobytes()).decode()
            self._picture = json.dumps({"jpeg": shown}).encode()


@plugin("observer", "page")
@contextmanager
def open_page(at: str) -> Iterator[LiveView]:
    """Live web page of a run, with a stop button."""
    with LiveView(at) as page:
        print(f"page: {page.url}", file=sys.stderr, flush=True)
        yield page


def _serve(line: socket.socket, host: str, port: int) -> None:
    from snakewalk.controller.view.live_page import serve  # noqa: PLC0415  viser stays here

    serve(line, host, port)


def host_and_port(address: str) -> tuple[str, int]:
    """Read HOST or HOST:PORT; the port is 8080 unless given.

    Raises:
        InputError: it is neither.

    """
    host, colon, port = address.rpartition(":")
    if not colon:
        host = address
        port = "8080"
    if not host or not port.isdigit() or not 0 <= int(port) <= 65_535:
        raise InputError(f"--view-at {address}: expected HOST or HOST:PORT, e.g. 127.0.0.1:8080")
    return host, int(port)
