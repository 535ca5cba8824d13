"""Several frame buffers at once: none draws into, or deletes from, another's."""

import gc
import subprocess
import sys

import cv2
import numpy as np
import pytest

from snakewalk.config.camera import CameraConfig
from snakewalk.config.loader import load_robot, load_world
from snakewalk.sim.rendering.offscreen import OffscreenError
from snakewalk.sim.rendering.top_view import TopView

ROBOT, WORLD = load_robot("yaw16"), load_world("flat")
AT_REST = np.concatenate([[0.0, 0.0, ROBOT.body_radius_m, 1.0, 0.0, 0.0, 0.0], np.zeros(16)])


UNCLOSED = """
import mujoco
from snakewalk.sim.rendering.offscreen import Offscreen, OffscreenError
try:
    screen = Offscreen(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8)
except OffscreenError as error:
    print(error)
"""


def view() -> TopView:
    try:
        return TopView(ROBOT, WORLD, CameraConfig(width_px=320, height_px=240), (0.0, 0.0))
    except OffscreenError as error:
        pytest.skip(str(error))


def shows_the_body(top: TopView) -> bool:
    return bool(cv2.absdiff(top.picture(AT_REST), top.empty_floor()).max() > 100)


@pytest.mark.slow
def test_a_view_still_draws_after_another_was_collected_unclosed() -> None:
    unclosed, kept = view(), view()
    assert shows_the_body(kept)
    del unclosed
    gc.collect()
    assert shows_the_body(kept)
    kept.close()


@pytest.mark.fast_cases(1)
@pytest.mark.costs("opens several renderers")
@pytest.mark.parametrize("closed_first", [0, 1])
def test_two_views_draw_by_turns_and_one_outlives_the_other(closed_first: int) -> None:
    views = [view(), view()]
    assert all(shows_the_body(each) for each in views)
    views.pop(closed_first).close()
    assert shows_the_body(views[0])
    views[0].close()


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("start_m", [(0.4, 0.3), (2.6, 0.2), (9.0, 0.0)])
def test_the_part_round_the_robot_is_drawn_as_in_the_whole_picture(
    start_m: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the middle, over an edge, out of view; the camera turned and near."""
    monkeypatch.setattr("snakewalk.sim.rendering.top_view.NOISE", 0.0)
    camera = CameraConfig(width_px=320, height_px=240, turn_rad=0.3, height_m=3.0)
    try:
        top = TopView(ROBOT, WORLD, camera, (0.0, 0.0))
    except OffscreenError as error:
        pytest.skip(str(error))
    bend = 0.4 * np.sin(0.6 * np.arange(16))
    qpos = np.concatenate([[*start_m], AT_REST[2:7], bend])
    part = top.picture(qpos)
    monkeypatch.setattr(TopView, "_window", lambda self, links: (0, 320, 0, 240))
    whole = top.picture(qpos)
    assert cv2.absdiff(part, whole).max() <= 2
    assert (cv2.absdiff(whole, top.empty_floor()).max() > 100) == (start_m[0] < 9.0)
    top.close()


@pytest.mark.costs("a program from nothing, which opens a renderer and ends")
def test_an_unclosed_frame_buffer_prints_no_traceback_at_exit() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", UNCLOSED], check=False, capture_output=True, text=True
    )
    if ended.stdout:
        pytest.skip(ended.stdout)
    assert (ended.returncode, ended.stderr) == (0, "")
