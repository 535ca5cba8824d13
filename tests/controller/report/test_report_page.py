"""The page: whole, self-contained, the same each time, and safe against what a log may say."""

import base64
import gzip
import json
import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.console.shared_text import without_folders
from snakewalk.controller.figures.path import body_outline_m
from snakewalk.controller.figures.style import thin
from snakewalk.controller.metrics.summary import RunSummary, SummarizedFriction, summary
from snakewalk.controller.report import artifacts
from snakewalk.controller.report import page as page_module
from snakewalk.controller.report.artifacts import make_artifacts
from snakewalk.controller.report.curves import curves_html
from snakewalk.controller.report.film import film_times
from snakewalk.controller.report.page import Drawings, Section, film_on_page, page
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import Event, RunRecord
from tests.helpers.browser import IN_A_BROWSER, chromium, new_tab

pytestmark = pytest.mark.usefixtures("legible_figures", "whole_report")

Make = Callable[..., Path]


class Sources(HTMLParser):
    """Collects what a page loads, and checks that tags are closed."""

    def __init__(self) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.sources += [v or "" for k, v in attrs if k in {"src", "href"}]
        if tag not in {"img", "meta", "br"}:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def parsed(html: str) -> Sources:
    reader = Sources()
    reader.feed(html)
    assert reader.open == []
    return reader


def build_report(record: RunRecord, folder: Path, numbers: RunSummary | None = None) -> Path:
    page_path = make_artifacts(record, folder, numbers, film=None).report
    assert page_path is not None
    return page_path


@pytest.fixture(scope="module")
def hills(make: Make, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Page of a run over hills, in a folder of its own."""
    folder = tmp_path_factory.mktemp("hills")
    log = make(folder / "run.mcap", seconds=12.0, ground="hills")
    return build_report(read_log(log), folder / "a")


def test_the_page_stands_alone(hills: Path) -> None:
    html = hills.read_text(encoding="utf-8")
    *sources, link = parsed(html).sources
    assert link == "summary.json", "no log stands beside this page"
    assert len(sources) == 5
    for source in sources:
        assert source.startswith("data:image/svg+xml;base64,")
        svg = ElementTree.fromstring(base64.b64decode(source.split(",", 1)[1]))
        assert svg.tag.endswith("svg")
    assert not re.search(r"<script[^>]*src", html), "nothing is loaded"
    assert "waypoint 1 reached" in html
    assert "Law of friction" in html
    assert (hills.parent / "summary.json").is_file()


def test_a_run_that_never_began_has_a_page(make: Make, tmp_path: Path) -> None:
    page_path = build_report(read_log(make(tmp_path / "run.mcap", seconds=0.0)), tmp_path)
    assert "0 of 4" in page_path.read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_run_that_hardly_began_has_a_page_and_always_the_same(make: Make, tmp_path: Path) -> None:
    log = make(tmp_path / "run.mcap", seconds=0.02, ground="hills")
    first = build_report(read_log(log), tmp_path / "a").read_bytes()
    again = build_report(read_log(log.rename(tmp_path / "b.mcap")), tmp_path / "c").read_bytes()
    assert again == first, "no date, no path, no chance in it"
    assert b"0 of 4" in first


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without pictures and curves, of which others tell."""
    monkeypatch.setattr(artifacts, "_draw", lambda *_: artifacts.Drawings([], "", ""))


@pytest.mark.usefixtures("undrawn")
def test_a_summary_that_is_known_is_not_computed_again(record: RunRecord, tmp_path: Path) -> None:
    numbers = replace(summary(record), run="as known")
    report = build_report(record, tmp_path, numbers=numbers)
    assert "<h1>as known</h1>" in report.read_text(encoding="utf-8")
    assert '"run": "as known"' in (tmp_path / "summary.json").read_text(encoding="utf-8")


def _film(folder: Path) -> Path:
    """Make a film whose name is markup."""
    film = folder / "' onload='x.webm"
    film.write_bytes(b"")
    return film


def test_what_the_log_says_is_text_not_markup(record: RunRecord, tmp_path: Path) -> None:
    evil = [Event(1.0, "info' onload='x", "<b>", "<script>alert(1)</script>")]
    names = replace(summary(record), run="<script>alert(2)", robot="' onload='x")
    run = record.header.run.model_copy(update={"track": "</pre><script>"})
    sections = [Section("<script>alert(3)", "' onload='x", "data:,' onload='x")]
    html = page(
        replace(record, events=evil, header=replace(record.header, run=run)),
        names,
        Drawings(sections, made="<script>alert(4)"),
        film=film_on_page(_film(tmp_path), tmp_path),
        links=["' onload='x"],
    )
    parsed(html)
    assert "<script>alert" not in html
    assert "</pre><script>" not in html
    assert "onload='x" not in html


def test_film_inside_or_beside(make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    film = tmp_path / "out" / "my film.mp4"
    film.parent.mkdir()
    film.write_bytes(b"\0" * 1000)
    small = film_on_page(film, tmp_path / "out").source
    assert re.match(r"data:video/mp4;base64,A{20}", small)
    monkeypatch.setattr(page_module, "INLINE_BYTES", 999)
    assert film_on_page(film, tmp_path / "out").source == "my%20film.mp4"
    assert film_on_page(film, tmp_path / "other").source == "../out/my%20film.mp4"
    with pytest.raises(InputError, match="no such film"):
        film_on_page(tmp_path / "gone.mp4", tmp_path)
    with pytest.raises(InputError, match=r"\.mp4, \.webm"):
        film_on_page(tmp_path / "film.avi", tmp_path)


def unpacked(html: str, name: str) -> str:
    packed = re.search(f"<script id='{name}' type='text/plain'>([^<]*)</script>", html)
    assert packed is not None
    return gzip.decompress(base64.b64decode(packed[1])).decode()


def numbers_of(array: dict[str, str]) -> np.ndarray:
    assert array["dtype"] == "f4"
    return np.frombuffer(base64.b64decode(array["bdata"]), "<f4")


def test_the_curves_are_the_logs_and_their_library_is_on_the_page(record: RunRecord) -> None:
    html = curves_html(record)
    assert "Plotly" in unpacked(html, "plotly")
    spec = json.loads(unpacked(html, "curves-data"))
    cycle = record.cycle
    names = [trace["name"] for trace in spec["traces"]]
    assert names[-4:] == ["asked", "sent", "measured", "current"]
    assert len(spec["joints"]) == cycle.asked_rad.shape[1]
    for joint in (0, 7):
        asked, sent, measured, current = map(numbers_of, spec["joints"][joint])
        assert np.array_equal(asked, cycle.asked_rad[:, joint].astype("f4"))
        assert np.array_equal(sent, cycle.sent_rad[:, joint].astype("f4"))
        assert np.array_equal(np.isfinite(measured), cycle.valid[:, joint])
        assert np.array_equal(current, cycle.current_a[:, joint].astype("f4"), equal_nan=True)
    (off,) = (trace for trace in spec["traces"] if trace["name"] == "from the path")
    assert np.nanmean(numbers_of(off["y"])) == pytest.approx(
        summary(record).path_error_mean_m, rel=1e-4
    )


def shared_cursor(page: Any, share: float) -> tuple[float, str, list[float]]:
    """Click into a map of the joint angles; time of the curves, place on the map, cursors."""
    angles = page.locator("section", has=page.get_by_role("heading", name="Joint angles"))
    box = angles.locator(".picture").bounding_box()
    angles.locator(".picture").click(
        position={"x": share * box["width"], "y": 0.15 * box["height"]}
    )
    return (
        page.evaluate("document.querySelector('#plot').layout.shapes.at(-1).x0"),
        page.evaluate("document.querySelector('.dot').style.left"),
        page.evaluate(
            "[...document.querySelectorAll('.cursor')].filter((line) => !line.hidden)"
            ".map((line) => parseFloat(line.style.left))"
        ),
    )


@pytest.mark.slow
@IN_A_BROWSER
def test_in_a_browser_curves_are_read_off_and_zoomed_and_a_telephone_holds_the_page(
    hills: Path,
) -> None:
    with chromium() as browser:
        page = new_tab(browser, viewport={"width": 1000, "height": 800})
        faults: list[str] = []
        page.on("pageerror", lambda fault: faults.append(str(fault)))
        page.goto(hills.as_uri())
        page.wait_for_selector(".js-plotly-plot .nsewdrag")
        curves = page.locator(".js-plotly-plot")
        curves.scroll_into_view_if_needed()
        curves.evaluate("plot => plot.on('plotly_hover', told => window.seen = told.points[0])")
        panel = page.locator(".js-plotly-plot .nsewdrag").first.bounding_box()
        assert panel is not None
        x, y = panel["x"] + 0.5 * panel["width"], panel["y"] + 0.5 * panel["height"]
        page.mouse.move(x, y)
        shown = page.locator(".hoverlayer .hovertext").first.text_content()
        page.wait_for_function("window.seen")
        name, value = page.evaluate("[seen.data.name, seen.y]")
        text, _, number = shown.rpartition(" ")
        assert text == name
        assert float(number) == pytest.approx(value, rel=1e-3)

        axis = "plot => plot.layout.xaxis.range.map(Number)"
        whole = curves.evaluate(axis)
        page.mouse.down()
        page.mouse.move(x + 0.25 * panel["width"], y, steps=4)
        page.mouse.up()
        page.wait_for_function(
            f"before => ({axis})(document.querySelector('.js-plotly-plot'))[0] > before",
            arg=whole[0],
        )
        first, last = curves.evaluate(axis)
        span = whole[1] - whole[0]
        assert first == pytest.approx(whole[0] + 0.5 * span, abs=0.02 * span)
        assert last == pytest.approx(whole[0] + 0.75 * span, abs=0.02 * span)

        shown = [shared_cursor(page, share) for share in (0.3, 0.6)]
        assert shown[0][0] < shown[1][0] - 1.0  # the time in the curves
        assert shown[0][1] != shown[1][1]  # the place on the map
        assert len(shown[0][2]) == len(shown[1][2]) >= 3
        assert all(before < after for before, after in zip(shown[0][2], shown[1][2], strict=True))
        page.emulate_media(color_scheme="dark")
        look = "getComputedStyle(document.body).backgroundColor"
        assert page.evaluate(look) == "rgb(20, 25, 30)"
        page.emulate_media(color_scheme="light")

        page.set_viewport_size({"width": 400, "height": 800})
        page.wait_for_function("document.documentElement.scrollWidth <= 400")
        hint = "box => getComputedStyle(box, '::before').content"
        assert "to the right" in page.locator(".wide").first.evaluate(hint)
    assert faults == []


@pytest.fixture
def filmed(hills: Path, tmp_path: Path) -> Path:
    """Page of the run over hills, with a film of the same times."""
    pytest.importorskip("av")
    from snakewalk.sim.rendering.movie_file import MovieFile

    with MovieFile(tmp_path / "film.mp4", 10, (64, 48)) as film:
        for _ in range(120):
            film.add(np.zeros((48, 64, 3), np.uint8))
    source = film_on_page(tmp_path / "film.mp4", tmp_path).source
    video = f"<video muted data-start='0' data-speed='1' src='{source}'></video><b id='clock'></b>"
    page_path = tmp_path / "report.html"
    html = hills.read_text(encoding="utf-8")
    page_path.write_text(html.replace("</header>", f"</header>{video}", 1), encoding="utf-8")
    return page_path


@pytest.mark.slow
@IN_A_BROWSER
def test_in_a_browser_film_map_curves_and_heat_maps_share_one_time(filmed: Path) -> None:
    with chromium() as browser:
        tab = new_tab(browser, viewport={"width": 1000, "height": 800})
        tab.goto(filmed.as_uri())
        tab.wait_for_selector(".js-plotly-plot .nsewdrag")
        tab.wait_for_function("film.readyState > 1")
        places = []
        for seconds in (3.0, 9.0):  # the film leads
            tab.evaluate(f"film.currentTime = {seconds}")
            tab.wait_for_function(
                f"Math.abs(plot.layout.shapes.at(-1).x0 - {seconds}) < 0.11"
                f" && Math.abs(parseFloat(clock.textContent) - {seconds}) < 0.11"
            )
            places.append(tab.evaluate("document.querySelector('.dot').style.left"))
        assert places[0] != places[1]
        tab.evaluate("plot.emit('plotly_click', {points: [{x: 6}]})")  # the curves lead
        tab.wait_for_function("Math.abs(film.currentTime - 6) < 0.11")
        (at_s, place, cursors) = shared_cursor(tab, 0.4)  # a heat map leads
        tab.wait_for_function(f"Math.abs(film.currentTime - {at_s}) < 0.11")
        assert place not in places
        assert len(cursors) >= 3
        way = tab.locator(".picture", has=tab.locator(".dot")).first
        way.click(position={"x": 1.0, "y": 1.0})  # the map leads: to its nearest point
        tab.wait_for_function(f"Math.abs(film.currentTime - {at_s}) > 0.11")
        tab.wait_for_function("Math.abs(film.currentTime - plot.layout.shapes.at(-1).x0) < 0.11")
        tab.set_viewport_size({"width": 390, "height": 844})  # cursors lie on wide pictures too
        widths = "(box) => [box.clientWidth, box.firstChild.clientWidth]"
        tab.wait_for_function(f"({widths})(document.querySelector('.wide .picture'))[1] === 860")
        assert tab.locator(".wide .picture").first.evaluate(widths) == [860, 860]


def test_a_supply_that_never_changes_is_told_and_not_drawn(record: RunRecord) -> None:
    level = replace(record.slow, voltage_v=np.full_like(record.slow.voltage_v, 12.0))
    html = curves_html(replace(record, slow=level))
    assert "lowest supply 12.0 V" in html
    spec = json.loads(unpacked(html, "curves-data"))
    assert "lowest supply" not in [trace["name"] for trace in spec["traces"]]
    falls = np.linspace(12.0, 11.0, level.voltage_v.size).reshape(level.voltage_v.shape)
    spec = json.loads(
        unpacked(curves_html(replace(record, slow=replace(level, voltage_v=falls))), "curves-data")
    )
    assert "lowest supply" in [trace["name"] for trace in spec["traces"]]


@pytest.mark.usefixtures("undrawn")
def test_an_event_leads_into_the_film(record: RunRecord, tmp_path: Path) -> None:
    start_s, faster = film_times(record)
    assert start_s == record.pose.time_s[0]
    assert faster >= 1.0
    (tmp_path / "film.mp4").write_bytes(bytes(10))
    (tmp_path / "log.mcap").write_bytes(b"")
    html = build_report(record, tmp_path).read_text(encoding="utf-8")
    assert f"data-start='{start_s:.3f}' data-speed='{faster:g}'" in html
    assert f"<button data-time='{record.events[0].time_s:.3f}'>" in html
    links = [source for source in parsed(html).sources if not source.startswith("data:")]
    assert links == ["log.mcap", "summary.json", "film.mp4"]


def test_the_foot_says_what_made_the_page(record: RunRecord) -> None:
    html = page(record, summary(record), Drawings([], made="Made by <me>"))
    assert "Made by &lt;me&gt;" in html


FOLDERS = {
    "/home/ann b/runs/log.mcap": "log.mcap",
    "--out=/home/ann b/x/": "--out=x",
    "see /home/ann/x.toml, ~/y/z.csv; at 0.1 rad/s": "see x.toml, z.csv; at 0.1 rad/s",
    "C:\\Users\\Ann\\x.toml": "x.toml",
    "/dev/ttyUSB0": "/dev/ttyUSB0",
    "1-8=/dev/ttyUSB0,9-16=/dev/ttyUSB1": "1-8=/dev/ttyUSB0,9-16=/dev/ttyUSB1",
    "socket://pi:5000": "socket://pi:5000",
    "runs/a/log.mcap and m/s or 1/2": "runs/a/log.mcap and m/s or 1/2",
    "a\u202eb": "a?b",
}


@pytest.mark.parametrize("text", FOLDERS)
def test_an_absolute_path_becomes_the_name_of_its_file(text: str) -> None:
    assert without_folders(text) == FOLDERS[text]


def test_a_page_contains_no_folder_of_the_user_unless_it_is_asked_for(record: RunRecord) -> None:
    secret = "/home/ann b/secret/x.toml"
    numbers = replace(summary(record), robot=secret, log_note=f"torn: {secret.replace(' ', '')}")
    events = [Event(0.0, "info", "map", "map: /home/ann/secret/x.toml: written")]
    run = record.header.run.model_copy(update={"track": secret, "robot": secret})
    record = replace(record, events=events, header=replace(record.header, run=run))
    drawings = Drawings([], made="Made by snakewalk run /home/ann/secret/x.toml")
    html = page(record, numbers, drawings)
    assert "x.toml" in html
    assert "secret" not in html
    assert "/home" not in html
    assert secret in page(record, numbers, drawings, folders=True)


@pytest.mark.parametrize(("backend", "bus"), [("sim", "simulation"), ("/dev/x", "/dev/x")])
def test_the_facts_name_the_bus(record: RunRecord, backend: str, bus: str) -> None:
    html = page(record, replace(summary(record), backend=backend), Drawings([]))
    assert f"<b>bus</b> {bus}</span>" in html


def test_the_tiles_are_those_that_the_run_has_numbers_for(record: RunRecord) -> None:
    numbers = replace(summary(record), carrier_share=None, friction_found=None)
    usual = page(record, numbers, Drawings([]))
    assert "Path error" in usual
    assert "On wide waves" not in usual
    assert "Friction found" not in usual
    found = SummarizedFriction(0.1, 0.3, 0.15, 0.25, (0.12, 0.18), (0.2, 0.3))
    more = page(record, replace(numbers, carrier_share=0.25, friction_found=found), Drawings([]))
    assert "On wide waves" in more
    assert "0.15 along, 0.25 across" in more
    assert "0.12 to 0.18, 0.20 to 0.30" in more
    no_path = page(record, replace(numbers, waypoints=0), Drawings([]))
    assert "Path error" not in no_path
    assert "Travelled" in no_path


def test_thinning_keeps_the_peaks_and_the_mean() -> None:
    time = np.arange(100_000) * 0.01
    values = np.sin(time)
    values[[31_337, 77_777]] = 9.0, -7.0
    values[500] = np.nan
    t, low, mean, high = thin(time, values)
    assert len(t) < 1000
    assert (np.diff(t) > 0).all()
    assert high.max() == 9.0
    assert low.min() == -7.0
    assert (low <= mean).all()
    assert (mean <= high).all()
    assert mean.mean() == pytest.approx(np.nanmean(values), abs=1e-3)
    short = thin(time[:50], values[:50])
    assert all(np.array_equal(part, values[:50]) for part in short[1:])


def test_outline_of_a_straight_body() -> None:
    """A straight body's outline is as long as the body, as wide, and symmetrical."""
    links = np.column_stack([1.0 - 0.07 * np.arange(17), np.zeros(17)])
    outline = body_outline_m(links, (0.035, 0.035), 0.03)
    assert outline[:, 0].max() == pytest.approx(1.0 + 0.035 + 0.03, abs=1e-3)
    assert outline[:, 0].min() == pytest.approx(1.0 - 16 * 0.07 - 0.035)
    assert np.abs(outline[:, 1]).max() == pytest.approx(0.03)
    x, y = outline.T
    area = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
    assert 0.85 * 0.06 * 1.19 < area < 0.06 * 1.25
    assert sorted(np.round(y, 9)) == sorted(np.round(-y, 9))
