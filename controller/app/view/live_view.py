"""A run's page: served by a process of its own, which is fed with the rows of the log."""

import base64
import json
import math
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.app.view.row_line import RunEnd

_START_S: Final = 60.0
"""How long the page may take to start: a busy machine imports slowly (ours)."""
_END_S: Final = 2.0
_PICTURE_S: Final = 0.5
"""Pictures of a camera are shown no more often (ours)."""
_QUALITY: Final = 70


class LiveView:
    """Serves the page; use it in a ``with``.

    Raises:
        InputError: viser is not installed, or nothing can be served there.

    """

    def __init__(self, at: str = "127.0.0.1:8080") -> None:
        require_extra("the page needs", "viser")
        host, port = host_and_port(at)
        ours, far = socket.socketpair()
        context = get_context("spawn")
        self._process = context.Process(target=_serve, args=(far, host, port), daemon=True)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # Ctrl-C is the run's
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        far.close()
        ours.settimeout(_START_S)
        try:
            said = json.loads(ours.makefile("rb").readline() or "{}")
        except OSError:
            said = {}
        self.url = str(said.get("url", ""))
        """To be opened in a browser; holds the token where one is asked for."""
        if not self.url:
            self._process.kill()
            raise InputError(f"--view-at {at}: {said.get('fault', 'the page did not start')}")
        self._end = RunEnd(ours)
        self._picture: bytes | None = None
        self._picture_s = -math.inf

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._end.close(0.5)
        self._process.join(_END_S)
        if self._process.is_alive():
            self._process.kill()

    held = True
    """The page has no dead man's button."""

    def pressed(self) -> list[str]:
        """What was set in the page since the last call, as an ``Operator`` takes it."""
        return self._end.commands()

    def on_gait(self, name: str, parameters: dict[str, float]) -> None:
        """Take the gait that an operator runs: the page then has its sliders."""
        row = {"name": name, "parameters": parameters}
        self._end.add("/gait", json.dumps(row).encode())

    def on_row(self, topic: str, row: bytes) -> None:
        """Take a row of the log; returns at once."""
        if topic == "/pose" and self._picture is not None:
            picture, self._picture = self._picture, None
            self._end.add("/picture", picture)
        self._end.add(topic, row)

    def on_picture(self, image: Image, time_s: float) -> None:
        """Take a picture (H, W, 3), blue first, of the run's camera, from its thread."""
        if time_s - self._picture_s < _PICTURE_S:
            return
        import cv2  # noqa: PLC0415  an extra

        self._picture_s = time_s
        whole, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        if whole:
            shown = base64.b64encode(data.tobytes()).decode()
            self._picture = json.dumps({"time_s": time_s, "jpeg": shown}).encode()

    def on_button(self, path: Path) -> None:
        """Take the run's stop button, which the page presses."""
        self._end.add("/button", json.dumps({"path": str(path)}).encode())


@contextmanager
def open_view(view: bool, at: str) -> Iterator[LiveView | None]:
    """Serve the page of a run where it is asked for, and print its address."""
    if not view:
        yield None
        return
    with LiveView(at) as page:
        print(f"page: {page.url}", file=sys.stderr, flush=True)
        yield page


def _serve(line: socket.socket, host: str, port: int) -> None:
    from snakewalk.controller.app.view.live_page import serve  # noqa: PLC0415  viser stays here

    serve(line, host, port)


def host_and_port(at: str) -> tuple[str, int]:
    """Read HOST or HOST:PORT; the port is 8080 unless given.

    Raises:
        InputError: it is neither.

    """
    host, colon, port = at.rpartition(":")
    if not colon:
        host, port = at, "8080"
    if not host or not port.isdigit() or not 0 <= int(port) <= 65_535:
        raise InputError(f"--view-at {at}: expected HOST or HOST:PORT, e.g. 127.0.0.1:8080")
    return host, int(port)
