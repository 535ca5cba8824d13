"""A crowd on the page: keys and clicks steer the first animal."""

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("viser")

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_world
from snakewalk.controller.repertoire.behaviour import Wandering
from snakewalk.controller.repertoire.crowd_page import CrowdPage
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.species import Species
from tests.helpers.browser import IN_A_BROWSER, chromium, new_tab

GROUND = HeightField(np.zeros((41, 41)), 0.25, -5.0, -5.0)

LIMIT_MS = 60_000.0
"""Largest time for one answer of the browser."""

pytestmark = pytest.mark.costs("the first test compiles the loops of a crowd")


@pytest.fixture
def page(repertoire: Repertoire) -> Iterator[CrowdPage]:
    crowd = Wandering([Species(repertoire, np.full(5, 0.25), np.full(17, 0.025))], GROUND)
    made = CrowdPage(crowd, load_world("flat"), GROUND, "127.0.0.1", 0)
    yield made
    made.server.stop()


def test_the_bodies_on_the_page_move(page: CrowdPage) -> None:
    before = [np.array(mesh.vertices) for _, mesh in page.drawn]
    assert [len(group) for group, _ in page.drawn] == [1, 4]
    page.step(4)
    for old, (_, mesh) in zip(before, page.drawn, strict=True):
        assert 1e-4 < np.abs(mesh.vertices - old).max() < 0.2


def test_keys_steer_and_a_click_sends(page: CrowdPage) -> None:
    crowd = page.wandering
    for change in ((1, 0, 0), (0, 1, 0)):
        page.steering(change)(None)
    page.step(1)
    assert crowd.wish == pytest.approx((0.25 * crowd.fastest_m_s[0], 0.3, 0.0))
    page.follow.value = True  # type: ignore[misc]
    page.step(1)
    x, y, _ = page.frame.position
    assert (x, y) == pytest.approx(tuple(-crowd.crowd.origin_m[0, :2]))
    page.on_click(
        SimpleNamespace(  # type: ignore[arg-type]
            ray_origin=np.array([1.0 + x, 2.0 + y, 3.0]), ray_direction=(0.0, 0.0, -1.0)
        )
    )
    page.step(1)
    assert crowd.wish is None
    assert crowd.goal_m[0, :2] == pytest.approx((1.0, 2.0), abs=1e-6)


@IN_A_BROWSER
@pytest.mark.slow
def test_keys_and_a_click_in_the_browser_steer_the_animal(page: CrowdPage) -> None:
    crowd = page.wandering
    with chromium() as browser:
        tab = new_tab(browser, viewport={"width": 900, "height": 600})
        tab.set_default_timeout(LIMIT_MS)
        tab.goto(page.url)
        tab.get_by_text("A click on the ground").wait_for()
        tab.keyboard.press("i")
        wait_in(tab, page, lambda: crowd.wish is not None)
        assert crowd.wish == pytest.approx((0.25 * crowd.fastest_m_s[0], 0.0, 0.0))
        tab.mouse.click(250, 480)
        wait_in(tab, page, lambda: crowd.wish is None)
        assert np.abs(crowd.goal_m[0, :2]).max() < 5.0


def wait_in(tab: Any, page: CrowdPage, is_true: Callable[[], bool]) -> None:
    """Move the crowd until something is true, for a limited time."""
    for _ in range(600):
        page.step(1)
        if is_true():
            return
        tab.wait_for_timeout(100)
    pytest.fail("the page did not answer")
