"""``snakewalk pose camera``: the simulated camera, a film as device, findings, the page."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.cameras.camera_check import CameraCheck, CameraReport
from snakewalk.controller.cameras.camera_findings import Lock, camera_findings
from snakewalk.controller.cameras.camera_latency import LatencyFit
from snakewalk.controller.cameras.camera_watch import CameraWatch, device_locks
from snakewalk.controller.cameras.markers.floor_markers import Bump, FloorFit
from snakewalk.controller.cameras.overhead_camera import CameraModel
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.run.factory import prepare_job
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.rendering.offscreen import OffscreenError
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.oracles.overhead_scene import DrawnView

PLACES = {0: (-1.2, -0.9), 3: (1.2, -0.9), 7: (1.2, 0.9), 12: (-1.2, 0.9)}
CAMERA = CameraConfig(
    width_px=320, height_px=240, field_width_m=3.0, height_m=3.0, rate_hz=20.0,
    centre_m=(0.0, 0.0), markers_m={str(number): place for number, place in PLACES.items()},
)  # fmt: skip
RUN = """name = "marked"
robot = "yaw16"
world = "flat"
waypoints_m = [[0.3, 0.0]]
[camera]
width_px = 320
height_px = 240
field_width_m = 3.0
height_m = 3.0
rate_hz = 20.0
centre_m = [-0.6, 0.0]
"""
MARKERS = """[camera.markers_m]
0 = [{0}, -0.9]
3 = [{1}, -0.9]
7 = [{1}, 0.9]
12 = [{0}, 0.9]
"""


def call(*words: str) -> tuple[int, dict[str, object]]:
    done = CliRunner().invoke(app, ["pose", "camera", *words, "--json"])
    if isinstance(done.exception, OffscreenError):
        pytest.skip(str(done.exception))
    assert done.stdout, done.exception
    found: dict[str, object] = json.loads(done.stdout)
    return done.exit_code, found


@pytest.mark.slow
def test_the_simulated_camera_is_a_frame_late(tmp_path: Path) -> None:
    """The planted latency is the period of a frame: 50 ms; 4 s of it tell it within some 10."""
    run = tmp_path / "marked.toml"
    run.write_text(RUN + MARKERS.format(-1.8, 0.6))
    code, found = call(str(run), "--seconds", "4")
    assert code == 0, found
    assert found["worst"] == "ok"
    assert found["frame_rate_hz"] == pytest.approx(20.0, abs=0.5)
    assert found["latency_ms"] == pytest.approx(50.0, abs=12.0)
    assert found["markers_found"] == {"0": 1.0, "3": 1.0, "7": 1.0, "12": 1.0}
    assert found["exposure"] == found["white_balance"] == "locked"


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second of a floor with markers, and its picture."""
    folder = tmp_path_factory.mktemp("film")
    model = CameraModel.straight_down(CAMERA, (0.0, 0.0))
    floor = DrawnView(load_robot("yaw16"), model, (320, 240), markers_m=PLACES).empty_floor()
    cv2.imwrite(str(folder / "floor.png"), floor)
    writer = cv2.VideoWriter(
        str(folder / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (320, 240)
    )
    for _ in range(20):
        writer.write(floor)
    writer.release()
    return folder


def test_a_film_is_looked_through_in_its_own_time(film: Path) -> None:
    run = film / "bench.toml"
    table = RUN.replace("[-0.6, 0.0]", "[0.0, 0.0]")
    run.write_text(f'{table}background = "{film / "floor.png"}"\n' + MARKERS.format(-1.2, 1.2))
    code, found = call(str(run), "--device", str(film / "film.avi"))
    assert (code, found["worst"]) == (0, "warn")
    assert found["frame_rate_hz"] == pytest.approx(20.0, abs=0.1)
    assert float(str(found["moved_px"])) < 0.2
    assert float(str(found["residual_mm"])) < 3.0
    assert found["latency_ms"] is None
    assert found["exposure"] == "not reported"
    few = film / "few.toml"
    few.write_text(table + MARKERS.format(-1.2, 1.2).replace("12 =", "13 =").replace("7 =", "8 ="))
    code, found = call(str(few), "--device", str(film / "film.avi"))
    assert (code, found["worst"]) == (1, "fail")
    assert "2 of 4 markers are seen" in str(found["findings"])


def test_joints_on_a_port_are_read_and_never_moved(
    film: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = load_robot("yaw16")
    line = SimLine(ServoBank(robot.servo_ids, robot.servo_models), BenchPlant(16))
    line.latency_s = 0.0
    monkeypatch.setattr(
        "snakewalk.controller.run.backend.open_port", lambda name, baud, clock=None: line
    )
    run = film / "port.toml"
    table = RUN.replace("[-0.6, 0.0]", "[0.0, 0.0]")
    run.write_text(f'{table}background = "{film / "floor.png"}"\n')
    words = ("--device", str(film / "film.avi"), "--port", "/dev/sim", "--seconds", "600")
    code, found = call(str(run), *words)
    assert (code, found["frames"]) == (0, 20)
    assert "the complete body was seen in 0 frames, its joints were read" in str(found["findings"])
    assert not line.firmware.bank["Torque Enable"].any()


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--port", "/dev/nosuch"), "--port: a simulated camera does not see real servos"),
        (("--device", "/nowhere/camera"), "OpenCV cannot open it"),
        (("--set", "run.world=pool"), "world"),
    ],
)
def test_what_cannot_be_looked_through_is_refused(words: tuple[str, ...], line: str) -> None:
    with pytest.raises(InputError, match=line):
        CliRunner().invoke(app, ["pose", "camera", *words], catch_exceptions=False)


FLOOR = FloorFit(np.eye(3), {1: 0.002, 2: 0.001}, {1: 0.15, 2: 0.151}, None)
GOOD = CameraReport(
    frames=160, size_px=(320, 240), duration_s=8.0, rate_hz=20.0, gap_max_s=0.05,
    seen={1: 1.0, 2: 1.0}, others=(), floor=FLOOR, fault="", bump=Bump((0.1, 0.0)),
    light_spread=0.001, latency=LatencyFit(0.04, 0.002, 0.95),
)  # fmt: skip
LOCKED: dict[str, Lock] = {"exposure": "locked", "white balance": "locked"}
Change = Callable[[], tuple[CameraReport, dict[str, Lock]]]


def test_a_good_camera_is_told_so() -> None:
    found = camera_findings(GOOD, CAMERA, LOCKED)
    assert {one.grade for one in found} == {"ok"}


@pytest.mark.parametrize(
    ("report", "locks", "check", "grade", "said"),
    [
        (replace(GOOD, rate_hz=9.0), LOCKED, "frames", "warn", "asked for are 20 a second"),
        (replace(GOOD, gap_max_s=0.4), LOCKED, "frames", "warn", "frames were lost"),
        (replace(GOOD, size_px=(640, 480)), LOCKED, "frames", "fail", "320 x 240"),
        (replace(GOOD, seen={}, others=(9,)), LOCKED, "markers", "warn", "in the picture are 9"),
        (replace(GOOD, seen={1: 1.0, 2: 0.3}), LOCKED, "markers", "fail", "marker 2: in view"),
        (replace(GOOD, floor=None, fault="none"), LOCKED, "floor", "fail", "none"),
        (replace(GOOD, floor=replace(FLOOR, residual_m={1: 0.1})), LOCKED, "floor", "fail",
         "the place of marker 1"),
        (replace(GOOD, floor=replace(FLOOR, side_m={1: 0.11})), LOCKED, "floor", "warn", "scaled"),
        (replace(GOOD, bump=Bump((4.0, 0.0))), LOCKED, "place", "warn", "moved by 4.0 px"),
        (replace(GOOD, bump=Bump((9.0, 0.0), undone=False)), LOCKED, "place", "fail", "up again"),
        (GOOD, {"exposure": "automatic"}, "exposure", "warn", "lock it"),
        (GOOD, {"exposure": "not reported"}, "exposure", "warn", "does not report"),
        (replace(GOOD, light_spread=0.1), LOCKED, "light", "warn", "10.0 %"),
        (replace(GOOD, latency=None), LOCKED, "latency", "warn", "--port"),
        (replace(GOOD, latency=LatencyFit(0.0, 0.0, 0.0, "why")), LOCKED, "latency", "warn", "why"),
    ],
)  # fmt: skip
def test_each_fault_has_its_finding(
    report: CameraReport, locks: dict[str, Lock], check: str, grade: str, said: str
) -> None:
    (found,) = [one for one in camera_findings(report, CAMERA, locks) if one.check == check]
    assert found.grade == grade
    assert said in found.found + found.remedy


def test_a_measured_latency_is_to_be_written_into_the_run() -> None:
    device = CAMERA.model_copy(update={"device": "0"})
    late = camera_findings(GOOD, device, LOCKED)[-1]
    assert (late.grade, late.remedy) == ("warn", "[camera] latency_s = 0.040")
    known = device.model_copy(update={"latency_s": 0.036})
    assert camera_findings(GOOD, known, LOCKED)[-1].grade == "ok"


class Device:
    """What OpenCV answers for a webcam."""

    def __init__(self, backend: str, exposure: float, white: float) -> None:
        self._backend = backend
        self._values = {cv2.CAP_PROP_AUTO_EXPOSURE: exposure, cv2.CAP_PROP_AUTO_WB: white}

    def getBackendName(self) -> str:
        return self._backend

    def get(self, key: int) -> float:
        return self._values[key]


@pytest.mark.parametrize(
    ("device", "exposure", "white"),
    [
        (Device("V4L2", 1.0, 0.0), "locked", "locked"),
        (Device("V4L2", 3.0, 1.0), "automatic", "automatic"),
        (Device("V4L2", -1.0, -1.0), "not reported", "not reported"),
        (Device("FFMPEG", 0.0, 0.0), "not reported", "not reported"),
    ],
)
def test_locks_are_those_of_video4linux(device: Device, exposure: str, white: str) -> None:
    found = device_locks(device)  # type: ignore[arg-type]
    assert found == {"exposure": exposure, "white balance": white}


def test_the_page_shows_picture_and_findings(film: Path) -> None:
    pytest.importorskip("viser")
    from snakewalk.controller.cameras.camera_page import CameraPage, with_markers

    prepared = prepare_job("flat-square", keys=None)
    camera = CAMERA.model_copy(update={"device": str(film / "film.avi")})
    run = prepared.run.model_copy(update={"camera": camera})
    page = CameraPage("127.0.0.1", 0, camera, CameraWatch(replace(prepared, run=run), None))
    try:
        check = CameraCheck(camera, prepared.robot, None)
        image = np.asarray(cv2.imread(str(film / "floor.png")), dtype=np.uint8)
        check.add_frame(image, 0.0)
        page.on_frame(image, check, 0.0)
        shown = re.sub("<[^>]*>", " ", page._rows.content)
        assert "all 4 found in every picture" in shown
        red_first = image[..., ::-1]  # as browsers have it; OpenCV reads blue first
        np.testing.assert_array_equal(page._picture.image, with_markers(red_first, check.markers))
        assert not np.array_equal(page._picture.image, red_first)
    finally:
        page.stop()
