"""Behaviours of the live page in Chromium: widths, connections, tabs, reloads, colours, the end.

One browser and one simulated run, which waits while a test looks. Each test names the phase of the
run that it needs; after a failed test, or in a later phase, another run begins. ``python -m pytest
--collect-only`` of this file lists the behaviours.
"""

import re
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import pytest

pytest.importorskip("viser")
pytest.importorskip("mujoco")

from tests.helpers.browser import IN_A_BROWSER, PATIENCE_S, chromium, new_tab
from tests.helpers.proxy import Proxied
from tests.helpers.stepped_page import SteppedPage

pytestmark = [
    pytest.mark.nightly("48 looks at one page in a browser, which a busy computer delays"),
    IN_A_BROWSER,
]
WIDTHS: Final = ((390, 844), (768, 1024), (1400, 900))
SIZES: Final = pytest.mark.parametrize("size", WIDTHS, ids=[str(width) for width, _ in WIDTHS])
CONFIRMED: Final = "stop requested"
ENDED: Final = "the run has ended: stop requested by E-STOP of the page"
REPORT: Final = "<title>the report of the run</title>"
REPORT_LINK: Final = "open the report"
NO_SCENE: Final = """
    for (const name of ["Arrays", "Elements", "ArraysInstanced", "ElementsInstanced"])
        WebGL2RenderingContext.prototype["draw" + name] = () => {};
    const ask = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (draw) => setTimeout(() => ask(draw), 100);
"""
"""The scene is not drawn: these tests look at the panels, on a computer without GPU."""


PHASES: Final = ("waiting", "running", "pressed", "ended")
"""Phases of a run in their order."""


def during(phase: str) -> pytest.MarkDecorator:
    """Mark a test that needs another phase than a running run."""
    return pytest.mark.parametrize("stage", [phase], indirect=True)


class Stage:
    """A run, its page behind a proxy, and a tab."""

    def __init__(self, browser: Any, folder: Path) -> None:
        self.browser = browser
        self.run = SteppedPage(folder / "run")
        self.proxy = Proxied(self.run.port)
        self.url = self.run.url.replace(f":{self.run.port}/", f":{self.proxy.port}/")
        self.context = browser.new_context(viewport={"width": 1400, "height": 900})
        self.context.add_init_script(NO_SCENE)
        self.tab = self.opened()
        self.phase = 0

    def reach(self, phase: int) -> None:
        """Let the run come to a phase."""
        steps: tuple[Callable[[], object], ...] = (self.begin, self.press, self.end)
        for step in steps[self.phase : phase]:
            step()
        self.phase = phase

    def begin(self) -> None:
        self.run.start()
        self.run.go(3.0)
        self.tab.get_by_text("torque off at once, latched").wait_for()

    def press(self) -> None:
        self.tab.keyboard.press("Escape")
        self.tab.get_by_text(CONFIRMED, exact=True).wait_for()

    def end(self) -> Any:
        """Let the run end, and return its result."""
        finished = self.run.end()
        self.tab.get_by_text(ENDED).wait_for()
        return finished

    def tidy(self) -> None:
        """Leave one light tab of usual size, and a connection without faults."""
        for tab in self.context.pages:
            if tab is not self.tab:
                tab.close()
        self.tab.set_viewport_size({"width": 1400, "height": 900})
        self.tab.emulate_media(color_scheme="light")
        if 0 < self.phase < PHASES.index("ended"):
            self.calm()

    def opened(self) -> Any:
        """Open the page in another tab of the same browser."""
        tab = new_tab(self.context)
        tab.set_default_timeout(60_000.0)
        tab.goto(self.url)
        return tab

    def text(self, name: str, tab: Any = None) -> str:
        """Text of a line of our own element."""
        return str((tab or self.tab).locator(f"#{name}").text_content())

    def wait(self, is_true: Callable[[], bool]) -> None:
        """Wait until something is true."""
        until_s = time.monotonic() + PATIENCE_S
        while not is_true():
            assert time.monotonic() < until_s
            self.tab.wait_for_timeout(100.0)

    def advance(self, seconds: float) -> None:
        """Let the run advance in parts, each of which the page draws."""
        for _ in range(4):
            self.run.go(0.25 * seconds)
            self.tab.wait_for_timeout(300.0)

    def calm(self) -> None:
        """Let everything pass, and wait until the page is up to date."""
        self.proxy.delay(0.0)
        self.proxy.drop(0)
        self.proxy.duplicate(0)
        self.proxy.go_on()
        self.tab.wait_for_function(NOT_OLD)
        self.tab.wait_for_function(f"{STATE}.textContent !== ''")

    def close(self) -> None:
        self.proxy.go_on()
        with suppress(AssertionError):  # a run that a failed test left waiting
            self.run.close()
        self.proxy.close()
        self.context.close()


RECORDED: Final = """() => {
    window.said = [];
    const state = document.getElementById("snakewalk-stop").shadowRoot.querySelector("#state");
    new MutationObserver(() => window.said.push(state.textContent)).observe(
        state, {childList: true, characterData: true, subtree: true});
}"""
"""Keeps all texts of the state, of which some are there for half a second only."""
ROOT: Final = "document.getElementById('snakewalk-stop').shadowRoot"
STATE: Final = f"{ROOT}.querySelector('#state')"
AGE: Final = f"{ROOT}.querySelector('#age')"
NOT_OLD: Final = "!document.documentElement.classList.contains('snakewalk-old')"
IS_OLD: Final = "document.documentElement.classList.contains('snakewalk-old')"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as started:
        yield started


@pytest.fixture(scope="module")
def stages(browser: Any) -> Iterator[list[Stage]]:
    """The run of the last test, if the next one may use it."""
    kept: list[Stage] = []
    yield kept
    for staged in kept:
        staged.close()


@pytest.fixture
def stage(
    stages: list[Stage],
    browser: Any,
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[Stage]:
    phase = PHASES.index(getattr(request, "param", "running"))
    if stages and stages[0].phase > phase:
        stages.pop().close()
    if not stages:
        folder = tmp_path_factory.mktemp("stage")
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("XDG_RUNTIME_DIR", str(folder))
            stages.append(Stage(browser, folder))
    failed = request.session.testsfailed
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(stages[0].run.folder.parent))
        stages[0].reach(phase)
        yield stages[0]
    if request.session.testsfailed > failed:
        stages.pop().close()
    else:
        stages[0].tidy()


# before the run


@during("waiting")
def test_before_the_run_e_stop_is_off_and_the_page_says_that_it_waits(stage: Stage) -> None:
    stage.tab.get_by_text("waiting for the run").wait_for()
    assert stage.tab.get_by_role("button", name="E-STOP").is_disabled()


@during("waiting")
def test_before_the_run_no_settings_of_the_drawing_library_are_shown(stage: Stage) -> None:
    stage.tab.get_by_text("snakewalk", exact=True).wait_for()
    stage.tab.wait_for_timeout(500.0)
    assert not stage.tab.get_by_text("Dev Settings").is_visible()


@during("waiting")
def test_the_title_is_ours_from_the_start(stage: Stage) -> None:
    stage.tab.wait_for_function("document.title === 'snakewalk'")


@during("waiting")
def test_a_reload_before_the_run_waits_again(stage: Stage) -> None:
    stage.tab.reload()
    stage.tab.get_by_text("waiting for the run").wait_for()


# the run


@during("waiting")
def test_e_stop_can_be_pressed_when_the_run_begins(stage: Stage) -> None:
    stage.reach(PHASES.index("running"))
    stage.tab.get_by_text("torque off at once, latched").wait_for()
    assert stage.tab.get_by_role("button", name="E-STOP").is_enabled()


def test_the_page_names_run_robot_time_and_speed(stage: Stage) -> None:
    stage.tab.get_by_text("lateral-undulation").first.wait_for()
    stage.tab.get_by_text("on yaw16").wait_for()
    stage.advance(2.0)
    stage.tab.get_by_text(re.compile(r"\d\.\d s, 0\.\d\d m/s")).wait_for()


def test_the_page_states_the_evidence_of_the_pose(stage: Stage) -> None:
    stage.tab.get_by_text("pose: measured by simulator").wait_for()


def test_each_servo_has_supply_and_age(stage: Stage) -> None:
    row = stage.tab.locator("tr", has_text="yaw_16 (ID 16)")
    row.wait_for()
    cells = row.locator("td").all_text_contents()
    assert cells[4] == "12.0"
    assert float(cells[5]) < 20.0


@SIZES
def test_e_stop_is_on_top_and_as_large_as_a_finger(stage: Stage, size: tuple[int, int]) -> None:
    stage.tab.set_viewport_size({"width": size[0], "height": size[1]})
    box = stage.tab.get_by_role("button", name="E-STOP").bounding_box()
    assert min(box["width"], box["height"]) >= 48.0
    assert (
        stage.tab.evaluate(
            "([x, y]) => document.elementFromPoint(x, y).id",
            [box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]],
        )
        == "snakewalk-stop"
    )


@SIZES
def test_nothing_needs_to_be_scrolled_sideways(stage: Stage, size: tuple[int, int]) -> None:
    stage.tab.set_viewport_size({"width": size[0], "height": size[1]})
    assert stage.tab.evaluate("document.documentElement.scrollWidth <= innerWidth")


@SIZES
def test_panels_do_not_cover_e_stop_or_its_state(stage: Stage, size: tuple[int, int]) -> None:
    stage.tab.set_viewport_size({"width": size[0], "height": size[1]})
    ours = stage.tab.evaluate(
        "(() => { const b = document.getElementById('snakewalk-stop').getBoundingClientRect();"
        " return [b.right, b.bottom]; })()"
    )
    heading = stage.tab.get_by_text("on yaw16")

    def is_free() -> bool:
        box = heading.bounding_box()
        return box is not None and bool(box["x"] > ours[0] or box["y"] > ours[1])

    stage.wait(is_free)


@SIZES
def test_ending_the_run_is_far_from_e_stop_and_from_halting(
    stage: Stage, size: tuple[int, int]
) -> None:
    stage.tab.set_viewport_size({"width": size[0], "height": size[1]})
    stage.tab.get_by_role("tab", name="gait").click()
    end = stage.tab.get_by_role("button", name="end the run")
    end.scroll_into_view_if_needed()
    halt = stage.tab.get_by_text("halt, go on").bounding_box()
    assert end.bounding_box()["y"] - halt["y"] > 100.0
    stage.tab.get_by_role("tab", name="servos").click()


def test_parameters_have_words_and_units_instead_of_keys(stage: Stage) -> None:
    stage.tab.get_by_role("tab", name="gait").click()
    stage.tab.get_by_text("frequency, Hz").wait_for()
    panel = stage.tab.locator("body").inner_text()
    assert "_rad" not in panel
    assert "_hz" not in panel
    stage.tab.get_by_role("tab", name="servos").click()


def test_only_e_stop_is_called_stop(stage: Stage) -> None:
    words = stage.tab.locator("body").inner_text() + stage.text("state")
    assert re.findall(r"(?i)\bstop\b", words.replace("E-STOP", "")) == []


def test_a_slider_changes_the_run_which_answers_with_an_event(stage: Stage) -> None:
    stage.tab.get_by_role("tab", name="gait").click()
    stage.tab.get_by_role("slider").first.focus()
    stage.tab.keyboard.press("ArrowRight")
    stage.advance(1.0)
    stage.tab.get_by_role("tab", name="events").click()
    stage.tab.get_by_text(re.compile(r"operator: frequency_hz = 0\.\d")).first.wait_for()
    stage.tab.get_by_role("tab", name="servos").click()


def test_a_reload_during_the_run_shows_the_run(stage: Stage) -> None:
    stage.tab.reload()
    stage.tab.get_by_text("yaw_16 (ID 16)").wait_for()
    stage.tab.get_by_text("torque off at once, latched").wait_for()
    stage.tab.wait_for_function("document.title === 'snakewalk'")


def test_the_element_comes_back_if_a_script_removes_it(stage: Stage) -> None:
    stage.tab.evaluate("document.getElementById('snakewalk-stop').remove()")
    stage.tab.wait_for_function("document.getElementById('snakewalk-stop') !== null")


# colours


def test_a_dark_system_gets_a_dark_page(stage: Stage) -> None:
    look = "getComputedStyle(document.body.firstElementChild).filter"
    assert stage.tab.evaluate(look) == "none"
    light = background(stage)
    stage.tab.emulate_media(color_scheme="dark")
    assert "invert" in stage.tab.evaluate(look)
    assert background(stage) != light
    assert contrast(stage, "state") > 4.5
    stage.tab.emulate_media(color_scheme="light")
    assert stage.tab.evaluate(look) == "none"
    assert contrast(stage, "state") > 4.5


def background(stage: Stage) -> str:
    """Colour behind the state."""
    return str(stage.tab.evaluate(f"getComputedStyle({STATE}).backgroundColor"))


def contrast(stage: Stage, name: str) -> float:
    """Ratio of luminance of a line of our element (WCAG 2.1)."""
    colours = stage.tab.evaluate(
        "(line) => [getComputedStyle(line).color, getComputedStyle(line).backgroundColor]",
        stage.tab.locator(f"#{name}").element_handle(),
    )
    lights = []
    for colour in colours:
        parts = [int(part) / 255.0 for part in re.findall(r"\d+", colour)[:3]]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
        lights.append(0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2])
    return float((max(lights) + 0.05) / (min(lights) + 0.05))


# connections


@SIZES
def test_a_stalled_connection_has_a_banner_in_sight_and_a_grey_page(
    stage: Stage, size: tuple[int, int]
) -> None:
    stage.tab.set_viewport_size({"width": size[0], "height": size[1]})
    stage.proxy.stall(both=True)
    stage.tab.wait_for_function(IS_OLD)
    box = stage.tab.locator("#age").bounding_box()
    assert 0.0 <= box["x"] <= box["x"] + box["width"] <= size[0]
    assert contrast(stage, "age") > 4.5
    grey = "getComputedStyle(document.body.firstElementChild).filter"
    assert "grayscale" in stage.tab.evaluate(grey)
    stage.calm()


def test_the_banner_counts_the_time_and_names_another_way(stage: Stage) -> None:
    stage.proxy.stall(both=True)
    stage.tab.wait_for_function(IS_OLD)
    seconds = [float(re.findall(r"\d+\.\d", stage.text("age"))[0])]
    stage.tab.wait_for_timeout(600.0)
    seconds.append(float(re.findall(r"\d+\.\d", stage.text("age"))[0]))
    assert 1.0 <= seconds[0] < seconds[1]
    assert "E-STOP may not arrive; use Ctrl-C or the switch" in stage.text("age")
    stage.calm()


def test_the_banner_goes_when_data_come_again(stage: Stage) -> None:
    stage.proxy.stall(both=True)
    stage.tab.wait_for_function(IS_OLD)
    stage.calm()
    assert stage.text("age") == ""


def test_a_run_that_sends_nothing_has_a_banner_although_the_page_answers(stage: Stage) -> None:
    stage.run.view.now_s += 5.0
    stage.tab.get_by_text(re.compile(r"no data for [5-9]\.\d s")).wait_for()
    stage.run.view.now_s -= 5.0
    stage.calm()


def test_a_delay_of_a_third_of_a_second_is_no_banner(stage: Stage) -> None:
    stage.proxy.delay(0.15)
    stage.tab.wait_for_timeout(2000.0)
    assert stage.tab.evaluate(NOT_OLD)
    stage.calm()


def test_a_cut_connection_is_opened_again(stage: Stage) -> None:
    stage.tab.evaluate(RECORDED)
    stage.proxy.cut()
    said = "window.said.some((text) => text.includes('no connection to the run'))"
    stage.tab.wait_for_function(said)
    stage.tab.get_by_text("torque off at once, latched").wait_for()
    stage.calm()


@pytest.mark.parametrize("fault", ["drop", "duplicate"])
def test_dropped_and_duplicated_bytes_heal(stage: Stage, fault: str) -> None:
    getattr(stage.proxy, fault)(3)
    stage.wait(lambda: stage.proxy.is_done)
    stage.tab.get_by_text("torque off at once, latched").wait_for()
    stage.calm()


def test_a_reload_while_the_connection_stalls_shows_the_run_afterwards(stage: Stage) -> None:
    stage.proxy.stall(for_s=1.0, both=True)
    stage.tab.reload()
    stage.tab.get_by_text("torque off at once, latched").wait_for()
    stage.calm()


# two tabs


def test_two_tabs_show_the_same_run_and_a_spectator_may_leave(stage: Stage) -> None:
    other = stage.opened()
    other.get_by_text("torque off at once, latched").wait_for()
    other.close()
    stage.run.view.now_s += 4.0
    stage.run.serve()
    assert not stage.run.view.is_operator_lost
    stage.run.view.now_s -= 4.0
    stage.calm()


def test_a_value_that_is_set_in_one_tab_is_shown_in_the_other(stage: Stage) -> None:
    other = stage.opened()
    for tab in (other, stage.tab):
        tab.get_by_role("tab", name="gait").click()
        tab.get_by_text("frequency, Hz").wait_for()
    value = stage.tab.get_by_role("slider").first.get_attribute("aria-valuenow")
    stage.tab.get_by_role("slider").first.focus()
    stage.tab.keyboard.press("ArrowRight")
    stage.advance(1.0)
    stage.wait(lambda: other.get_by_role("slider").first.get_attribute("aria-valuenow") != value)
    other.close()
    stage.tab.get_by_role("tab", name="servos").click()


# E-STOP


def test_a_press_during_a_stall_is_not_confirmed_until_the_run_confirms_it(stage: Stage) -> None:
    stage.proxy.stall(both=True)
    stage.tab.keyboard.press("Escape")
    stage.tab.get_by_text("the run has not confirmed it").wait_for()
    stage.proxy.wait_for_a_message()
    assert CONFIRMED not in stage.text("state")
    stage.proxy.go_on()
    stage.tab.get_by_text(CONFIRMED, exact=True).wait_for()
    stage.phase = PHASES.index("pressed")


@during("pressed")
def test_a_reload_after_the_press_shows_it(stage: Stage) -> None:
    stage.tab.reload()
    stage.tab.get_by_text(CONFIRMED, exact=True).wait_for()


@during("pressed")
def test_a_second_press_and_a_press_in_a_second_tab_are_harmless(stage: Stage) -> None:
    other = stage.opened()
    other.get_by_text(CONFIRMED, exact=True).wait_for()
    other.keyboard.press("Escape")
    stage.tab.keyboard.press("Escape")
    other.get_by_text(CONFIRMED, exact=True).wait_for()
    stage.tab.get_by_text(CONFIRMED, exact=True).wait_for()


# the end


@during("pressed")
def test_the_run_ends_with_e_stop_and_every_tab_says_so(stage: Stage) -> None:
    finished = stage.end()
    stage.phase = PHASES.index("ended")
    assert finished.outcome.tripped == "stop requested by E-STOP of the page"
    for tab in stage.context.pages:
        tab.get_by_text(ENDED).wait_for()
        assert tab.get_by_role("button", name="E-STOP").is_disabled()


@during("ended")
def test_the_end_has_the_verdict_and_a_title(stage: Stage) -> None:
    stage.tab.wait_for_function(f"{ROOT}.querySelector('#verdict').textContent !== ''")
    assert stage.run.finished.verdict.text in stage.text("verdict")
    stage.tab.wait_for_function("document.title === 'snakewalk: the run has ended'")


@during("ended")
def test_the_end_has_no_banner(stage: Stage) -> None:
    stage.run.view.now_s += 60.0
    stage.tab.wait_for_timeout(1200.0)
    assert stage.tab.evaluate(NOT_OLD)


@during("ended")
def test_escape_after_the_end_does_nothing(stage: Stage) -> None:
    stage.tab.keyboard.press("Escape")
    stage.tab.wait_for_timeout(300.0)
    assert "the run has ended" in stage.text("state")


@during("ended")
def test_a_reload_after_the_end_shows_the_end(stage: Stage) -> None:
    stage.tab.reload()
    stage.tab.get_by_text(ENDED).wait_for()
    stage.tab.get_by_text("yaw_16 (ID 16)").wait_for()
    assert not stage.tab.get_by_text("Dev Settings").is_visible()


@during("ended")
def test_the_end_has_a_link_that_opens_the_report(stage: Stage) -> None:
    Path(stage.run.finished.verdict.report).write_text(REPORT, encoding="utf-8")
    stage.run.view.page.end(lambda: True)
    stage.tab.get_by_text(REPORT_LINK).wait_for()
    assert opened_title(stage) == "the report of the run"


def opened_title(stage: Stage) -> str:
    """Title of the page that the link to the report opens."""
    with stage.context.expect_page() as opened:
        stage.tab.get_by_text(REPORT_LINK).click()
    title = str(opened.value.title())
    opened.value.close()
    return title


@during("ended")
def test_end_and_verdict_stay_when_the_server_is_gone_also_after_a_reload(stage: Stage) -> None:
    stage.tab.wait_for_function(f"{ROOT}.querySelector('#verdict').textContent !== ''")
    Path(stage.run.finished.verdict.report).write_text(REPORT, encoding="utf-8")
    stage.run.view.page.end(lambda: True)
    stage.run.view.close()
    stage.proxy.cut()
    stage.tab.wait_for_timeout(1500.0)
    assert "the run has ended" in stage.text("state")
    stage.tab.reload()
    stage.tab.get_by_text(ENDED).wait_for()
    stage.tab.get_by_text(stage.run.finished.verdict.sentence).first.wait_for()
    assert stage.tab.title() == "snakewalk: the run has ended"
    assert opened_title(stage) == "the report of the run"
    stage.tab.emulate_media(color_scheme="dark")
    assert stage.tab.evaluate("getComputedStyle(document.documentElement).colorScheme") != ""
