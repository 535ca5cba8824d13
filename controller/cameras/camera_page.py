"""The page of a camera check: its picture with the markers, and the findings so far."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape

import cv2
import numpy as np

from snakewalk.config.arrays import Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.camera_check import CameraCheck
from snakewalk.controller.cameras.camera_findings import camera_findings
from snakewalk.controller.cameras.camera_watch import CameraWatch
from snakewalk.controller.cameras.markers.floor_markers import Markers
from snakewalk.controller.view.live_view import host_and_port
from snakewalk.controller.view.page_server import open_page
from snakewalk.drivers.clock import WallClock

_EVERY_S = 0.2
"""Time between two pictures on the page."""
_REPORT_S = 1.0
"""Time between two reports on the page."""
_WIDTH_PX = 700.0
_COLOURS = {"ok": "#1b7a3a", "warn": "#a15c00", "fail": "#b3121a"}
_MARK = (230, 60, 30)


class CameraPage:
    """Serves the page; ``stop`` it."""

    def __init__(self, host: str, port: int, camera: CameraConfig, watch: CameraWatch) -> None:
        self._camera = camera
        self._watch = watch
        self._server, self.url = open_page(host, port)
        """To be opened in a browser; contains the token."""
        blank = np.full((camera.height_px, camera.width_px, 3), 230, np.uint8)
        panel = self._server.gui.add_panel()
        with panel.add_tab(f"camera {watch.name}"):
            self._picture = self._server.gui.add_image(blank, format="jpeg")
        panel.float(x=16.0, y=16.0, width=_WIDTH_PX)
        self._rows = self._server.gui.add_html("<p>waiting for a frame</p>")
        self._clock = WallClock()
        self._shown_s = self._told_s = -np.inf
        self._ahead_s: float | None = None

    def on_frame(self, image: Image, check: CameraCheck, time_s: float) -> None:
        """Process a frame; a simulated camera is slowed to real time."""
        now_s = self._clock.now_s()
        if self._ahead_s is None:
            self._ahead_s = now_s - time_s
        if self._camera.device is None:
            self._clock.sleep_until_s(time_s + self._ahead_s)
        if now_s - self._shown_s < _EVERY_S:
            return
        self._shown_s = now_s
        blue_first = self._camera.device is not None  # OpenCV's order
        picture = image[..., ::-1] if blue_first else image
        self._picture.image = with_markers(picture, check.markers)
        if now_s - self._told_s < _REPORT_S:
            return
        self._told_s = now_s
        camera_faults = camera_findings(check.report(), self._camera, self._watch.locks)
        rows = "".join(
            f"<tr><td style='color:{_COLOURS[finding.grade]};font-weight:600'>{finding.grade}</td>"
            f"<td style='padding:.2em .6em'>{escape(finding.check)}</td><td>{escape(finding.found)}"
            + (f"<br><b>&rarr; {escape(finding.remedy)}</b>" if finding.remedy else "")
            + "</td></tr>"
            for finding in camera_faults
        )
        self._rows.content = (
            f"<table style='font-size:13px;margin:.6em;vertical-align:top'>{rows}</table>"
        )

    def stop(self) -> None:
        """Stop serving."""
        self._server.stop()


@contextmanager
def open_camera_page(at: str, camera: CameraConfig, watch: CameraWatch) -> Iterator[CameraPage]:
    """Serve the page and print its address.

    Raises:
        InputError: viser is not installed, or the address cannot be used.

    """
    host, port = host_and_port(at)
    try:
        page = CameraPage(host, port, camera, watch)
    except OSError as error:
        raise InputError(f"--view-at {at}: {error}") from None
    try:
        print(f"page: {page.url}", file=sys.stderr, flush=True)
        yield page
    finally:
        page.stop()


def with_markers(image: Image, markers: Markers) -> Image:
    """(H, W, 3) a picture with outlined, numbered markers."""
    shown = np.ascontiguousarray(image).copy()
    for name, px in markers.items():
        corners = np.rint(px).astype(np.int32).reshape(-1, 1, 2)
        cv2.polylines(shown, [corners], True, _MARK, 1, cv2.LINE_AA)
        x, y = np.rint(px.max(axis=0)).astype(int).tolist()
        cv2.putText(shown, str(name), (x + 4, y), cv2.FONT_HERSHEY_SIMPLEX, 0.6, _MARK, 2)
    return shown
