"""The page of a run that moves servos on a pseudo-terminal, in a browser: what it shows, E-STOP."""

import base64
import contextlib
import dataclasses
import json
import os
import re
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

pytest.importorskip("viser")

from snakewalk.config.arrays import Image
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.hands import Hands
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.observers import Observers
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.row_line import RunEnd
from snakewalk.controller.runtime.drive import Progress
from snakewalk.controller.view.commands.demo import RECORDED
from snakewalk.controller.view.dashboard import Dashboard
from snakewalk.controller.view.dead_man import DeadMan
from snakewalk.controller.view.gait_panel import GaitPanel
from snakewalk.controller.view.live_view import LiveView
from snakewalk.controller.view.operators import OPERATOR_BACK, OPERATOR_LOST
from snakewalk.controller.view.page_server import open_page
from snakewalk.controller.view.scene import BodyScene
from snakewalk.controller.view.waypoint_panel import WaypointPanel
from snakewalk.sim.serve.servo_bus import ServoBus
from tests.helpers.browser import IN_A_BROWSER, PATIENCE_S, chromium, new_tab
from tests.helpers.bus import PATIENT
from tests.helpers.page_view import PageView
from tests.helpers.proxy import Proxied
from tests.helpers.stepped_page import SteppedPage

ROOT = Path(__file__).parents[3]
COMMAND = "from snakewalk.controller.cli.main import main; main()"
ROBOT = 'name = "quartet"\njoint_axes = "yyyy"\nyaw_limit_rad = 1.4\n'


@contextmanager
def run(folder: Path, *words: str) -> Iterator[subprocess.Popen[str]]:
    """A live command with a page, whose address it prints first."""
    options = ["--live", "--no-film", "--out", "run", "--view", "--view-at", "127.0.0.1:0"]
    with subprocess.Popen(
        [sys.executable, "-c", COMMAND, *words, *options],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        env=os.environ | {"XDG_RUNTIME_DIR": str(folder), "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as child:
        yield child
        child.kill()


@contextmanager
def browsed(
    child: subprocess.Popen[str],
    width: int = 700,
    script: str = "",
    through: Callable[[int], int] = lambda port: port,
) -> Iterator[Any]:
    """The page of a run in a browser; ``through`` returns the port of a proxy."""
    assert child.stderr is not None
    line = child.stderr.readline()
    url = re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", line)
    assert url is not None, line + child.stderr.read()
    with chromium() as browser:
        page = new_tab(browser, viewport={"width": width, "height": 500})
        page.add_init_script(script)
        port = int(re.findall(r":(\d+)/", url[0])[0])
        page.goto(url[0].replace(f":{port}/", f":{through(port)}/"))
        page.get_by_text("torque off at once, latched").wait_for()
        yield page


def end_of_run(page: Any) -> str:
    """Wait for the end of the run, and return why the page says that it has ended."""
    state = page.locator("#state", has_text="the run has ended: ")
    state.wait_for()
    return str(state.inner_text()).removeprefix("the run has ended: ")


def test_a_page_shows_a_run_and_its_e_stop_latches_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    view, seen = PageView(), []

    def on_progress(progress: Progress) -> None:
        view.page.step()
        seen.append(progress.time_s)
        if len(seen) == 40:
            assert "waypoint" not in view.shown("_state")
            assert view.shown("_bars").count("(ID ") == 16
            assert view.page._scene is not None
            assert np.ptp(view.page._scene._body.batched_positions, axis=0).max() > 0.5
            view.page._stop.pressed()

    finished = run_robot(
        RunRequest(
            prepare_gait("lateral-undulation", seconds=10.0),
            tmp_path / "run",
            observers=Observers(view),
            on_progress=on_progress,
        )
    )
    view.page.step()
    view.close()
    assert finished.outcome.tripped == "stop requested by E-STOP of the page"
    assert len(seen) == 41  # the cycle in which it latched
    said = view.page._stop._state
    assert said["text"] == "the run has ended: stop requested by E-STOP of the page"
    assert not said["armed"]
    assert finished.verdict.text in said["verdict"]
    assert "trip: stop requested" in view.shown("_events")
    assert finished.verdict.cause is not None
    assert finished.verdict.cause in view.shown("_verdict")


@pytest.mark.slow
def test_what_is_set_in_the_page_changes_the_gait(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    view = PageView()
    hands = Hands([view], view)  # type: ignore[list-item, arg-type]

    def on_progress(progress: Progress) -> None:
        view.page.step()
        panel = view.page._gait_panel
        assert panel is not None
        if progress.time_s > 0.2 and panel._inputs["frequency_hz"].value == 0.5:
            moved_by_a_browser(panel, "frequency_hz", 0.3)
            panel._inputs["frequency_hz"].value = 0.3

    finished = run_robot(
        RunRequest(
            dataclasses.replace(
                prepare_gait("lateral-undulation", seconds=1.0), make_operator=hands.operator
            ),
            tmp_path / "run",
            observers=Observers(view),
            stop_requested=hands.torque_off,
            on_progress=on_progress,
        )
    )
    view.close()
    said = [event.text for event in finished.record.events if event.kind == "operator"]
    assert said == ["frequency_hz = 0.3"]


def test_a_gamepad_in_the_browser_is_held_steers_and_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    view, cycles = PageView(), count()
    hands = Hands([view], view)  # type: ignore[list-item, arg-type]
    texts: list[str] = []
    script = {
        30: (),  # it is seen: from now on it has to be held
        60: (HOLD,),
        61: (HOLD, MIRROR),
        150: (HOLD, STOP),
    }

    def on_progress(progress: Progress) -> None:
        cycle = next(cycles)
        view.now_s = 100.0 + progress.time_s
        if cycle in script:
            assert view.gamepad.take("browser", pad_state(*script[cycle]))
        if cycle in script or cycle % 10 == 0:
            view.page.step()
            assert view.page._gamepad_panel is not None
            texts.append(view.page._gamepad_panel._shown)

    finished = run_robot(
        RunRequest(
            dataclasses.replace(
                prepare_gait("lateral-undulation", seconds=10.0), make_operator=hands.operator
            ),
            tmp_path / "run",
            observers=Observers(view),
            stop_requested=hands.torque_off,
            on_progress=on_progress,
        )
    )
    view.close()
    assert finished.outcome.tripped == "stop requested by E-STOP of a gamepad"
    events = [each for each in finished.record.events if each.kind == "operator"]
    let_go, held = "button released: the body holds its shape", "held: it moves"
    assert [each.text for each in events[:4]] == [let_go, held, "mirror = True", let_go]
    assert 0.3 < events[3].time_s - events[1].time_s < 0.4  # it said nothing any more
    for what in ("No gamepad.", "Button released:", "Held:", "The gamepad does not respond:"):
        assert any(what in text for text in texts)


HOLD, MIRROR, STOP = 4, 1, 11


def pad_state(*pressed: int) -> str:
    """What the page's script sends of a gamepad."""
    buttons = [int(k in pressed) for k in range(17)]
    state = {"name": "Pad", "mapping": "standard", "axes": [0.0, 0.0], "buttons": buttons}
    return json.dumps(state)


@pytest.mark.slow
def test_the_body_walks_to_where_the_ground_was_clicked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    view = PageView()
    LiveView.on_course(view)  # type: ignore[arg-type]
    at: dict[str, float] = {}
    cycles = count()

    def on_progress(progress: Progress) -> None:
        if next(cycles) % 20 and progress.time_s > 0.5:  # each is held to the page's pace
            return
        view.page.step()
        panel, scene = view.page._waypoint_panel, view.page._scene
        assert panel is not None
        assert scene is not None
        if not at and progress.time_s > 1.0:
            at["clicked"] = progress.time_s
            clicked(panel, "waypoint", (0.4, 0.2))
            clicked(panel, "", (2.0, 2.0))  # nothing waits for it
            clicked(panel, "", (40.0, 0.0), "shift")
            assert "you did not click on the ground" in panel._text.content
        if progress.reached == 2 and "reached" not in at:
            at["reached"] = progress.time_s
            view.page._servos_s = -1.0  # not held back
        if "reached" in at and progress.time_s > at["reached"] + 1.0 and "end" not in at:
            at["end"] = progress.time_s
            assert len(scene._waypoints) == 2
            assert "waypoint 2 of 2" in view.shown("_state")
            assert "no waypoint is left: the body holds" in panel._text.content
            panel._commanding("end")(None)

    finished = run_robot(
        RunRequest(
            prepare_walk("flat-slalom", motion="serpenoid", waypoints_m=((0.1, 0.0),)),
            tmp_path / "run",
            observers=Observers(view),
            waypoint_commands=view.pressed,
            on_progress=on_progress,
        )
    )
    view.close()
    assert finished.outcome.complete
    assert finished.outcome.waypoints == 2
    record = finished.record
    np.testing.assert_allclose(record.header.plan.waypoints_m, [(0.1, 0.0), (0.4, 0.2)], atol=1e-3)
    assert np.hypot(*(record.pose.centre_m[-1, :2] - (0.4, 0.2))) < 0.35
    assert finished.summary.waypoints_reached == finished.summary.waypoints == 2
    assert len(record.paths) == 2
    assert 1.0 < at["end"] - at["reached"] < 1.5


@pytest.mark.slow
def test_on_servos_it_is_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, servo_bus: Callable[..., ServoBus]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "quartet.toml").write_text(ROBOT)
    robot = str(tmp_path / "quartet.toml")
    commands = [["next=1,0.3"], ["waypoint=99,0"], *[[]] * 5, ["end"]]
    said: list[tuple[str, str]] = []
    finished = run_robot(
        RunRequest(
            prepare_walk("flat-slalom", motion="serpenoid", robot=robot, keys=PATIENT),
            tmp_path / "run",
            servo_bus("1-4").path,
            waypoint_commands=lambda: commands.pop(0) if commands else [],
            on_event=lambda kind, text: said.append((kind, text)),
        )
    )
    assert [kind for kind, _ in said] == ["operator", "refused", "operator"]
    assert finished.outcome.tripped is None
    assert finished.record.waypoints[1][1].tolist() == [[1.0, 0.3]]
    assert len(finished.record.paths) == 2
    assert len(finished.record.header.plan.waypoints_m) == 0  # the end leaves out what is left


def clicked(
    panel: WaypointPanel, word: str, at_m: tuple[float, float], modifier: str | None = None
) -> None:
    """Click on a place of the floor, from above and beside it, after a button was pressed.

    The page's scene is moved below the camera while it follows the body.
    """
    if word:
        panel._arming(word)(None)
    origin_m = np.add([*at_m, 0.0], [-1.0, -2.0, 3.0]) + panel._scene._frame.position
    panel._on_click(
        SimpleNamespace(ray_origin=origin_m, ray_direction=(1.0, 2.0, -3.0), modifier=modifier)  # type: ignore[arg-type]
    )


def test_a_click_finds_the_ground_that_it_falls_on(record: RunRecord) -> None:
    field = HeightField(np.outer(np.ones(41), np.abs(np.arange(-20, 21)) * 0.05), 0.1, -2.0, -2.0)
    server, _ = open_page("127.0.0.1", 0)
    scene = BodyScene(server, dataclasses.replace(record.header, ground=field))
    assert scene.ground_m((-3.0, 0.0, 0.5), (1.0, 0.0, 0.0)) is None  # came through the border
    assert scene.ground_m((0.0, 0.0, 0.5), (1.0, 0.0, 0.0)) == pytest.approx((1.0, 0.0), abs=1e-6)
    assert scene.ground_m((0.0, 0.3, 5.0), (0.0, 0.0, -2.0)) == pytest.approx((0.0, 0.3), abs=1e-6)
    assert scene.ground_m((0.0, 0.3, -5.0), (0.0, 0.0, 1.0)) is None  # from below
    assert scene.ground_m((0.0, 0.3, 5.0), (0.0, 0.0, 1.0)) is None  # the sky
    scene._frame.position = (1.0, 0.0, 0.0)  # the body is followed
    assert scene.ground_m((0.0, 0.3, 5.0), (0.0, 0.0, -2.0)) == pytest.approx((-1.0, 0.3), abs=1e-6)
    server.stop()


def test_the_camera_of_a_run_is_shown_twice_a_second(record: RunRecord) -> None:
    cv2 = pytest.importorskip("cv2")
    view = PageView()
    view.page._dashboard = Dashboard(view.page._server, record.header, {})
    colour = np.full((48, 64, 3), (200, 120, 40), dtype=np.uint8)  # red first

    def shown_at(time_s: float, image: Image) -> Image | None:
        view.on_picture(image[..., ::-1], time_s)
        view.on_row("/pose", b"{}")
        for topic, row in view.sent():
            if topic == "/picture":
                view.page._store_row(topic, row)
        assert view.page._dashboard is not None
        picture = view.page._dashboard._picture
        if picture is None:
            return None
        data = base64.b64decode(picture.content.partition("base64,")[2].partition("'")[0])
        return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]

    first = shown_at(1.0, colour)
    assert first is not None
    assert np.abs(first.astype(int) - colour).max() < 12
    assert np.array_equal(shown_at(1.3, colour // 2), first)
    assert shown_at(1.6, colour // 2).mean() < 0.6 * first.mean()  # type: ignore[union-attr]
    view.close()


def test_a_pose_that_the_joints_do_not_confirm_is_shown_as_unconfirmed() -> None:
    rows: dict[str, dict[str, Any]] = {}
    with RECORDED.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            rows.setdefault(channel.topic, json.loads(message.data))
    pose = {"kind": "measured", "source": "udp", "position_m": None, "heading_rad": None}
    rows["/config"]["evidence"]["pose"] = pose
    view = PageView()
    view.on_row("/config", json.dumps(rows["/config"]).encode())

    def is_shown(text: str) -> bool:
        for topic in ("/cycle", "/pose_source", "/pose"):
            view.on_row(topic, json.dumps(rows[topic]).encode())
        view.page.step()
        return text in view.shown("_state")

    for is_confirmed, text in ((1, "measured"), (0, "unconfirmed"), (1, "measured")):
        rows["/pose_source"] = {"time_s": 0.0, "latency_s": 0.0, "is_confirmed": is_confirmed}
        assert any(is_shown(f"pose: {text} by udp") for _ in range(100))
    view.close()


def test_a_picture_is_sent_once_before_the_next_pose() -> None:
    pytest.importorskip("cv2")
    view = PageView()
    view.on_picture(np.zeros((48, 64, 3), dtype=np.uint8), 1.0)
    sent = []
    for _ in range(2):
        view.on_row("/pose", b"{}")
        sent.append([topic for topic, _ in view.sent()])
    view.close()
    assert sent == [["/picture", "/pose"], ["/pose"]]


@pytest.mark.costs("starts the process of a page")
def test_a_page_is_served_at_its_url() -> None:
    with LiveView("127.0.0.1:0") as view:
        address, _, token = view.url.partition("?token=")
        assert address.startswith("http://127.0.0.1:")
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        with browser.open(view.url, timeout=PATIENCE_S) as answer:
            assert (answer.status, len(token) > 20) == (200, True)


def moved_by_a_browser(panel: GaitPanel, name: str, value: object) -> None:
    target = SimpleNamespace(value=value)
    panel._command_of(name)(SimpleNamespace(client_id=1, target=target))


def test_a_slider_orders_its_newest_value_and_shows_what_the_run_made_of_it() -> None:
    server, _ = open_page("127.0.0.1", 0)
    panel = GaitPanel(server, server.gui.add_tab_group(), load_robot("alternating16"))
    defaults = make_gait("sidewinding").params.model_dump()
    panel.show("sidewinding", defaults)
    assert "rolling" in panel._gait.options
    inputs = panel._inputs
    assert set(inputs) == set(defaults)
    frequency = inputs["frequency_hz"]
    assert frequency.label == "frequency, Hz"
    assert panel.commands(1.0) == []  # what `show` sets is no command
    for value in (0.6, 0.61, 0.62):
        moved_by_a_browser(panel, "frequency_hz", value)
    frequency.value = 0.62
    assert panel.commands(1.0) == ["frequency_hz=0.62"]
    moved_by_a_browser(panel, "mirror", True)
    assert panel.commands(1.1) == []  # too soon after the last
    panel.show("sidewinding", defaults | {"frequency_hz": 0.61})
    assert frequency.value == 0.62  # it is being moved
    assert panel.commands(1.25) == ["mirror=1"]
    panel.commands(2.3)
    assert frequency.value == 0.61  # as the run has it
    panel.show("rolling", make_gait("rolling").params.model_dump(), "9 Hz is too fast")
    assert "9 Hz is too fast" in panel._limit.content
    assert panel._gait.value == "rolling"
    assert "waves" not in panel._inputs
    server.stop()


def test_what_a_browser_of_somebody_else_sets_is_no_command_or_a_short_one() -> None:
    server, _ = open_page("127.0.0.1", 0)
    panel = GaitPanel(server, server.gui.add_tab_group(), load_robot("alternating16"))
    panel.show("sidewinding", make_gait("sidewinding").params.model_dump())
    for value in ("0.5", None, [[[]]], {"a": 1}, "x" * 2_000_000):
        moved_by_a_browser(panel, "frequency_hz", value)
    assert panel.commands(1.0) == []
    moved_by_a_browser(panel, "gait", "x" * 2_000_000)
    assert panel.commands(2.0) == ["gait=" + "x" * 100]
    moved_by_a_browser(panel, "frequency_hz", float("nan"))
    assert panel.commands(3.0) == ["frequency_hz=nan"]  # which the run rejects
    server.stop()


@pytest.mark.slow
@IN_A_BROWSER
def test_a_browser_shows_the_run_and_its_end_by_e_stop(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    words = ["gait", "run", "lateral-undulation", "--seconds", "3600"]
    words += ["--set", "run.safety.lost_observer=warn"]  # a busy machine silences the page
    with run(tmp_path, *words) as child, browsed(child) as page:
        button = page.get_by_role("button", name="E-STOP")
        page.get_by_text("lateral-undulation").wait_for()
        page.get_by_text("yaw_16 (ID 16)").wait_for()
        page.keyboard.press("Escape")
        assert end_of_run(page) == "stop requested by E-STOP of the page"
        assert button.is_disabled()
        assert child.wait(PATIENCE_S) == 1
        assert end_of_run(page) == "stop requested by E-STOP of the page"  # nothing is served now
        verdict = page.locator("#verdict").inner_text()
        assert "stop requested by E-STOP of the page; more: snakewalk" in verdict
    record = read_log(tmp_path / "run" / "log.mcap")
    assert [event.kind for event in record.events][-2:] == ["trip", "stop"]


@pytest.mark.nightly("a browser and servos in real time, which a busy computer delays")
@IN_A_BROWSER
def test_e_stop_of_a_browser_switches_torque_off(
    tmp_path: Path, servo_bus: Callable[..., ServoBus]
) -> None:
    bus = servo_bus("1-4")
    (tmp_path / "quartet.toml").write_text(ROBOT)
    words = ["gait", "run", "lateral-undulation", "--seconds", "1000"]
    words += ["--robot", "quartet.toml", "--port", bus.path]
    words += ["--set", "run.safety.lost_observer=warn"]  # a busy machine silences the page
    words += [word for key, value in PATIENT.items() for word in ("--set", f"{key}={value}")]
    with run(tmp_path, *words) as child, browsed(child) as page:
        page.get_by_text("yaw_04 (ID 4)").wait_for()
        assert bus["Torque Enable"].tolist() == [1] * 4
        page.keyboard.press("Escape")
        assert end_of_run(page) == "stop requested by E-STOP of the page"
        assert bus["Torque Enable"].tolist() == [0] * 4
        assert child.wait(PATIENCE_S) == 1


STALL_S = 2.5
"""How long the connection stalls in real time: commands of 1 s are late."""


def set_by_hand(page: Any, slider: Any) -> None:
    """Move the slider until the run obeys: a busy computer may be late, and late is dropped."""
    obeyed = page.get_by_text(re.compile(r"operator: frequency_hz = 0\.\d"))
    late = pytest.importorskip("playwright.sync_api").TimeoutError
    for _ in range(12):
        page.get_by_role("tab", name="gait").click()
        slider.focus()
        page.keyboard.press("ArrowRight")
        page.get_by_role("tab", name="events").click()
        with contextlib.suppress(late):
            obeyed.first.wait_for(timeout=5_000.0)
            return
    pytest.fail("the run obeyed none of 12 changes of a slider")


@pytest.mark.nightly("a browser at a running gait: 40 s of CPU")
@IN_A_BROWSER
def test_a_slider_that_was_set_while_the_connection_stalled_is_no_event_of_the_run(
    tmp_path: Path, servo_bus: Callable[..., ServoBus]
) -> None:
    bus = servo_bus("1-4")
    (tmp_path / "quartet.toml").write_text(ROBOT)
    words = ["gait", "run", "lateral-undulation", "--seconds", "1000"]
    words += ["--robot", "quartet.toml", "--port", bus.path]
    words += ["--set", "run.safety.lost_observer=warn"]  # a busy machine silences the page
    words += [word for key, value in PATIENT.items() for word in ("--set", f"{key}={value}")]
    proxies: list[Proxied] = []

    def through(port: int) -> int:
        proxies.append(Proxied(port))
        return proxies[0].port

    with run(tmp_path, *words) as child, browsed(child, through=through) as page:
        page.get_by_text("yaw_04 (ID 4)").wait_for()
        page.get_by_role("tab", name="gait").click()
        slider = page.get_by_role("slider").first
        set_by_hand(page, slider)
        page.get_by_role("tab", name="gait").click()
        slider.focus()
        proxies[0].stall(for_s=STALL_S)
        page.keyboard.press("ArrowRight")
        page.get_by_role("tab", name="events").click()
        page.get_by_text("late and is dropped").first.wait_for()
        page.keyboard.press("Escape")
        assert end_of_run(page) == "stop requested by E-STOP of the page"
        assert child.wait(PATIENCE_S) == 1
    proxies[0].close()
    record = read_log(tmp_path / "run" / "log.mcap")
    texts = [event.text for event in record.events]
    obeyed = [k for k, text in enumerate(texts) if text.startswith("frequency_hz = ")]
    dropped = [k for k, text in enumerate(texts) if "late and is dropped" in text]
    assert obeyed
    assert max(obeyed) < max(dropped)


def test_the_run_loses_the_page_with_the_browser_that_steers() -> None:
    ours, far = socket.socketpair()
    view = LiveView.__new__(LiveView)
    view._end, view._what = RunEnd(ours), "page"
    view._dead_man, view._is_operator_lost = DeadMan(), False
    far.sendall(f"{OPERATOR_LOST}\n".encode())
    assert view.pressed() == []
    assert "the browser that steers has not answered for 3 s" in str(view.lost(0.0))
    far.sendall(f"{OPERATOR_BACK}\n".encode())
    assert view.pressed() == []
    assert view.lost(0.0) is None
    far.close()


@pytest.mark.nightly("a browser at a running gait: 20 s of CPU")
@IN_A_BROWSER
def test_an_operator_who_closes_the_page_stops_the_run(
    tmp_path: Path, servo_bus: Callable[..., ServoBus]
) -> None:
    bus = servo_bus("1-4")
    (tmp_path / "quartet.toml").write_text(ROBOT)
    words = ["gait", "run", "lateral-undulation", "--seconds", "1000"]
    words += ["--robot", "quartet.toml", "--port", bus.path]
    words += [word for key, value in PATIENT.items() for word in ("--set", f"{key}={value}")]
    with run(tmp_path, *words) as child, browsed(child) as page:
        page.get_by_text("yaw_04 (ID 4)").wait_for()
        page.get_by_role("tab", name="gait").click()
        set_by_hand(page, page.get_by_role("slider").first)
        page.close()
        assert child.wait(PATIENCE_S) == 1
        assert bus["Torque Enable"].tolist() == [0] * 4
    record = read_log(tmp_path / "run" / "log.mcap")
    trips = [event.text for event in record.events if event.kind == "trip"]
    assert "the browser that steers has not answered for 3 s" in trips[0]


FAKE_PAD = """
    window.pad = {id: "Pad (fake)", mapping: "standard", connected: true, axes: [0, 0, 0, 0],
                  buttons: Array.from({length: 17}, () => ({pressed: false}))};
    window.press = (k, down) => { window.pad.buttons[k] = {pressed: down}; };
    window.pads = [null];
    navigator.getGamepads = () => window.pads;
"""


@pytest.mark.nightly("a browser at a running gait: 16 s of CPU")
@IN_A_BROWSER
def test_a_gamepad_at_the_browser_steers_a_gait_and_its_button_stops_it(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    words = ["gait", "run", "lateral-undulation", "--seconds", "1000"]
    with run(tmp_path, *words) as child, browsed(child, script=FAKE_PAD) as page:
        page.get_by_role("tab", name="gamepad").click()
        page.get_by_text("No gamepad. Press a button").wait_for()
        page.evaluate("window.pads = [window.pad]")
        page.get_by_text("Button released: the body holds its shape.").wait_for()
        page.evaluate("window.press(4, true)")
        page.get_by_text("Held: the body moves.").wait_for()
        page.evaluate("window.press(1, true)")
        page.get_by_role("tab", name="events").click()
        page.get_by_text("operator: mirror = True").wait_for()
        page.evaluate("window.press(11, true)")
        page.get_by_text("the run has ended: stop requested by E-STOP of a gamepad").wait_for()
        assert child.wait(PATIENCE_S) == 1
    record = read_log(tmp_path / "run" / "log.mcap")
    said = [event.text for event in record.events if event.kind == "operator"]
    assert said[:2] == ["button released: the body holds its shape", "held: it moves"]


@pytest.mark.slow
@IN_A_BROWSER
def test_a_run_plans_a_path_to_a_waypoint_that_is_clicked_in_a_browser(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In simulated time, which waits for the browser."""
    pytest.importorskip("mujoco")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    run = SteppedPage(tmp_path / "run", walks=True)
    try:
        with chromium() as browser:
            page = new_tab(browser, viewport={"width": 700, "height": 500})
            page.set_default_timeout(60_000.0)
            page.goto(run.url)
            run.start()
            page.get_by_role("tab", name="walk").click()
            page.get_by_role("button", name="add a waypoint").click()
            armed = page.get_by_text("now click on the ground")
            armed.wait_for()
            for _ in range(40):  # a page that draws its first picture receives no click
                page.mouse.click(300, 300)
                page.wait_for_timeout(500.0)
                if not armed.is_visible():
                    break
            run.go(1.0)
            page.get_by_text("waypoint 2 at").wait_for()
        run.go(4.0)
    finally:
        run.close()
    record = read_log(tmp_path / "run" / "log.mcap")
    said = [event.text for event in record.events]
    point = next(text for text in said if text.startswith("waypoint 2 at ("))
    assert record.header.plan.waypoints_m[1] == pytest.approx(
        tuple(float(number) for number in re.findall(r"-?[0-9.]+", point)[1:]), abs=0.01
    )
    assert any("another path to waypoint" in text for text in said), said


@pytest.mark.nightly("a browser and a run in real time, which a busy computer delays")
@IN_A_BROWSER
def test_in_a_browser_a_click_on_the_ground_is_where_the_body_goes(
    tmp_path: Path,
) -> None:
    pytest.importorskip("mujoco")
    words = ["run", "flat-slalom", "--motion", "serpenoid", "--set", "run.waypoints_m=[[0.3,0]]"]
    with run(tmp_path, *words) as child, browsed(child, width=1000) as page:
        page.get_by_role("tab", name="walk").click()
        page.get_by_role("button", name="add a waypoint").click()
        armed = page.get_by_text("now click on the ground")
        armed.wait_for()
        while armed.is_visible():  # a page that still draws its first picture receives no click
            page.mouse.click(420, 330)
            page.wait_for_timeout(1000.0)
        page.get_by_text("no waypoint is left: the body holds, and waits for another").wait_for()
        page.get_by_role("button", name="end the run").click()
        page.get_by_text("the run has ended").wait_for()
        assert child.wait(PATIENCE_S) == 0
    record = read_log(tmp_path / "run" / "log.mcap")
    waypoints_m = record.header.plan.waypoints_m
    assert len(waypoints_m) == 2
    assert np.hypot(*(record.pose.centre_m[-1, :2] - waypoints_m[1])) < 0.35
    assert len(record.paths) >= 2  # and one where it missed its way
