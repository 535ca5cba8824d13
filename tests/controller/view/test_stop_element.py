"""Our own element in the page: E-STOP in sight at every width, and no late input."""

import json
import os
import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("viser")

from websockets.sync.client import connect

from snakewalk.controller.view.fresh_line import Freshness
from snakewalk.controller.view.operators import Operators
from snakewalk.controller.view.page_server import open_page
from snakewalk.controller.view.stop_element import StopElement
from tests.helpers.browser import IN_A_BROWSER, PATIENCE_S, chromium, new_tab
from tests.helpers.proxy import Proxied


class Page:
    """A page with a slider, without a run."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.freshness = Freshness(lambda: self.now_s)
        self.stop = StopElement(self.freshness)
        self.server, self.url = open_page("127.0.0.1", 0, self.stop, freshness=self.freshness)
        self.presses: list[str] = []
        self.is_pressed = threading.Event()
        self.moved = threading.Event()
        self.slider = self.server.gui.add_slider("speed", 0, 10, 1, 5)
        self.slider.on_update(lambda event: self.moved.set())
        self.server.gui.add_html("<div style='height:3000px'>tall</div>")
        self.stop.press = self.press

    def press(self, who: str) -> str:
        self.presses.append(who)
        self.is_pressed.set()
        return "stop requested"


@pytest.fixture
def page() -> Iterator[Page]:
    served = Page()
    yield served
    served.server.stop()


def test_its_socket_shows_the_state_and_presses_the_button_once_for_each_message(
    page: Page,
) -> None:
    port, token = page.server.get_port(), page.url.rpartition("=")[2]
    headers = {"Cookie": f"snakewalk-{port}={token}", "Origin": f"http://127.0.0.1:{port}"}
    with connect(f"ws://127.0.0.1:{port}/stop", additional_headers=headers) as line:
        state = json.loads(line.recv(PATIENCE_S))
        assert (state["armed"], state["text"]) == (False, "waiting for the run")
        page.stop.arm()
        assert json.loads(line.recv(PATIENCE_S))["armed"]
        page.now_s += 50.0  # a stop is never too late
        line.send("stop")
        assert json.loads(line.recv(PATIENCE_S))["text"] == "stop requested"
        assert page.presses == ["E-STOP of the page"]
        line.send("late 2500")
        page.stop.ended("done")
        assert json.loads(line.recv(PATIENCE_S))["text"] == "the run has ended: done"
        assert page.stop.late_s() == [147.5]
        line.send("late x")  # nothing of our script: the line is closed
        assert list(line) == []


def test_a_report_is_sent_again_when_it_was_written_again(page: Page, tmp_path: Path) -> None:
    port, token = page.server.get_port(), page.url.rpartition("=")[2]
    headers = {"Cookie": f"snakewalk-{port}={token}", "Origin": f"http://127.0.0.1:{port}"}
    report = tmp_path / "report.html"
    with connect(f"ws://127.0.0.1:{port}/stop", additional_headers=headers) as line:

        def received() -> bytes:
            return next(said for said in line if isinstance(said, bytes))

        page.stop.offer(report)  # not drawn yet
        for number, text in enumerate((b"without film", b"with film"), start=1):
            report.write_bytes(text)
            os.utime(report, (number, number))
            page.stop.offer(report)
            assert received() == text
            assert not page.stop.is_shown
            line.send("kept")
            until_s = time.monotonic() + PATIENCE_S
            while not page.stop.is_shown:
                assert time.monotonic() < until_s


def test_a_run_that_ends_while_its_button_is_pressed_is_shown_as_ended(page: Page) -> None:
    def press(who: str) -> str:
        page.stop.ended(f"stop requested by {who}")  # another thread, before the press returns
        return "stop requested"

    page.stop.arm()
    page.stop.press = press
    port, token = page.server.get_port(), page.url.rpartition("=")[2]
    headers = {"Cookie": f"snakewalk-{port}={token}", "Origin": f"http://127.0.0.1:{port}"}
    with connect(f"ws://127.0.0.1:{port}/stop", additional_headers=headers) as line:
        assert json.loads(line.recv(PATIENCE_S))["armed"]
        line.send("stop")
        shown = json.loads(line.recv(PATIENCE_S))
    assert shown["text"] == "the run has ended: stop requested by E-STOP of the page"
    assert not shown["armed"]


def test_a_browser_that_steered_and_answers_no_more_is_lost() -> None:
    now_s = [10.0]
    operators = Operators(lambda: now_s[0])

    def lost_after(seconds: float, *heard: str) -> bool:
        lost = False
        for _ in range(round(20 * seconds)):
            now_s[0] += 0.05
            for tab in heard:
                operators.hear(tab, now_s[0])
            lost = operators.are_lost()
        return lost

    assert not lost_after(1.0, "a", "b")
    operators.note_input("a")
    assert not lost_after(5.0, "b")  # nothing was sent to the run
    operators.hear("a", now_s[0])
    operators.note_input("a")
    operators.note_command()
    assert not lost_after(5.0, "a")  # a spectator may leave
    assert not lost_after(2.5, "b")  # the page is loaded again
    assert not lost_after(0.1, "a", "b")
    assert lost_after(3.5, "b")
    assert not lost_after(0.1, "a", "b")
    now_s[0] += 60.0  # the machine stood still
    assert not operators.are_lost()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as started:
        yield started


ON_TOP = """() => {
    const host = document.getElementById("snakewalk-stop"), box = host.getBoundingClientRect();
    const inside = box.left >= 0 && box.top >= 0 && box.right <= innerWidth
        && box.bottom <= innerHeight;
    const at = document.elementFromPoint(box.left + 20, box.top + 20);
    return inside && at === host;
}"""


@pytest.mark.slow
@IN_A_BROWSER
def test_e_stop_is_in_sight_at_every_width_and_needs_one_tap(page: Page, browser: Any) -> None:
    context = browser.new_context(has_touch=True, viewport={"width": 390, "height": 844})
    tab = new_tab(context)
    tab.goto(page.url)
    tab.get_by_text("speed").wait_for()
    button = tab.get_by_role("button", name="E-STOP")
    assert button.is_disabled()
    page.stop.arm()
    tab.get_by_text("torque off at once, latched").wait_for()
    for width, height in ((390, 844), (768, 1024), (1400, 900)):
        tab.set_viewport_size({"width": width, "height": height})
        assert tab.evaluate(ON_TOP), width
        if width == 390:  # viser's panel is below the scene, at its full width
            panel = tab.locator(".mantine-Paper-root[style*='position: fixed']").bounding_box()
            assert (panel["x"], panel["width"]) == (0.0, 390.0)
        page.is_pressed.clear()
        box = button.bounding_box()
        assert min(box["width"], box["height"]) >= 48.0  # a finger
        tab.touchscreen.tap(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        assert page.is_pressed.wait(PATIENCE_S), width
    page.is_pressed.clear()
    tab.get_by_role("slider").first.focus()
    tab.keyboard.press("Escape")
    assert page.is_pressed.wait(PATIENCE_S)
    tab.evaluate("document.getElementById('snakewalk-stop').remove()")  # by viser's own script
    tab.wait_for_function("document.getElementById('snakewalk-stop') !== null")
    context.close()


@pytest.fixture
def proxy(page: Page) -> Iterator[Proxied]:
    started = Proxied(page.server.get_port())
    yield started
    started.close()


@pytest.mark.nightly("a browser in real time, which a busy computer delays")
@IN_A_BROWSER
def test_a_slider_that_was_set_while_the_connection_stalled_moves_nothing(
    page: Page, browser: Any, proxy: Proxied
) -> None:
    tab = new_tab(browser)
    tab.goto(page.url.replace(str(page.server.get_port()), str(proxy.port)))
    slider = tab.get_by_role("slider").first
    slider.focus()
    tab.keyboard.press("ArrowRight")
    assert page.moved.wait(PATIENCE_S)
    assert page.slider.value == 6
    page.moved.clear()
    proxy.stall()
    tab.keyboard.press("ArrowRight")
    tab.wait_for_function("document.querySelector('[role=slider]')?.ariaValueNow === '7'")
    proxy.wait_for_a_message()
    page.now_s += 15.0
    proxy.go_on()
    tab.wait_for_function("document.querySelector('[role=slider]')?.ariaValueNow === '6'")
    assert page.slider.value == 6
    assert not page.moved.is_set()
    assert page.stop.late_s()[0] <= 100.0
    tab.close()


@pytest.mark.slow
@IN_A_BROWSER
def test_a_page_says_how_old_it_is_and_that_a_press_is_not_confirmed(
    page: Page, browser: Any, proxy: Proxied
) -> None:
    page.stop.newest_s = page.now_s
    page.stop.arm()
    tab = new_tab(browser)
    tab.goto(page.url.replace(str(page.server.get_port()), str(proxy.port)))
    tab.get_by_text("torque off at once, latched").wait_for()
    tab.wait_for_function("!document.documentElement.classList.contains('snakewalk-old')")
    proxy.stall(both=True)
    tab.get_by_text("E-STOP may not arrive; use Ctrl-C or the switch").wait_for()
    assert tab.evaluate("document.documentElement.classList.contains('snakewalk-old')")
    tab.keyboard.press("Escape")
    tab.get_by_text("the run has not confirmed it").wait_for()
    assert page.presses == []
    proxy.go_on()
    tab.get_by_text("stop requested").wait_for()
    assert set(page.presses) == {"E-STOP of the page"}
    tab.wait_for_function("!document.documentElement.classList.contains('snakewalk-old')")
    page.now_s += 5.0  # the run sends nothing, but the page answers
    tab.get_by_text(re.compile(r"no data for [5-9]\.\d s")).wait_for()
    page.stop.ended("done")
    page.stop.judged("0 of 4 waypoints")
    tab.get_by_text("the run has ended: done").wait_for()
    page.server.stop()
    tab.wait_for_function("document.title === 'snakewalk: the run has ended'")
    proxy.cut()
    tab.get_by_text("the run has ended: done").wait_for()
    tab.get_by_text("0 of 4 waypoints").wait_for()
    tab.close()


LATE_INPUT = """() => {
    const tried = [];
    document.body.addEventListener("click", () => tried.push("click"));
    const sent = window.performance.now;
    window.late = (ms) => { window.performance.now = () => sent.call(performance) + ms; };
    window.tried = tried;
}"""


@pytest.mark.slow
@IN_A_BROWSER
def test_a_click_that_waited_in_the_browser_is_dropped(page: Page, browser: Any) -> None:
    tab = new_tab(browser)
    tab.goto(page.url)
    tab.get_by_text("speed").wait_for()
    page.stop.arm()
    tab.get_by_text("torque off at once, latched").wait_for()
    tab.evaluate(LATE_INPUT)
    while tab.evaluate("window.tried.length") == 0:  # a busy machine makes clicks late
        tab.mouse.click(300, 300)
    tab.evaluate("window.late(5000)")
    tab.mouse.click(300, 300)
    assert tab.evaluate("window.tried.length") == 1
    tab.get_by_role("button", name="E-STOP").click()  # which is accepted at any age
    assert page.is_pressed.wait(PATIENCE_S)
    assert min(page.stop.late_s()) <= 95.1
    tab.close()
