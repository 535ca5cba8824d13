"""A log in the page: time goes on, is moved, and ends; without a browser."""

import re
from collections.abc import Iterator
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser")

from scipy.spatial.transform import Rotation

from snakewalk.config.errors import InputError
from snakewalk.config.ground import water_surface_m
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.cli.main import main
from snakewalk.controller.kinematics.legs import leg_segments_m
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.metrics.verdict import verdict
from snakewalk.controller.runlog.evidence import SIMULATED, Kind, PoseEvidence
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.tables import record_of
from snakewalk.controller.view.log_page import LogPage
from snakewalk.controller.view.scene import contour_step_m, contours_m
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.physics.solids import Solid, solids


@pytest.fixture
def page(record: RunRecord) -> Iterator[LogPage]:
    made = LogPage({"log": record}, "127.0.0.1", 0)
    yield made
    made.server.stop()


def state(page: LogPage) -> str:
    return re.sub("<[^>]*>", " ", page._shown[0].board._state.content)


def test_it_plays_in_time_follows_the_slider_and_stops_at_the_end(page: LogPage) -> None:
    end_s = page._end_s
    page.step(0.05, 0.0)
    assert page.time_s == page._begin_s
    page.toggle()
    page.step(0.5, 0.5)
    assert page.time_s == pytest.approx(page._begin_s + 0.5)
    assert f"{page.time_s:.1f} s" in state(page)
    page._slider.value = end_s - 0.5
    page.step(0.05, 1.0)
    assert page.time_s == pytest.approx(end_s - 0.5, abs=0.01)
    page._speed.value = "10"
    page.step(0.2, 1.5)
    assert page.time_s == end_s
    assert not page.playing
    page.toggle()
    assert page.time_s == page._begin_s


def test_it_states_the_verdict_of_the_log(page: LogPage, record: RunRecord) -> None:
    shown = unescape(re.sub("<[^>]*>", " ", page._shown[0].board._verdict.content))
    found = verdict(record, summary(record))
    assert found.text in shown
    assert found.evidence in shown


def test_bars_and_curves_show_the_rows_of_the_time(page: LogPage, record: RunRecord) -> None:
    page._slider.value = round(0.5 * (page._begin_s + page._end_s), 2)
    page.step(0.05, 0.0)
    cycle = int((record.cycle.time_s <= page.time_s).sum()) - 1
    bars = re.sub("<[^>]*>", " ", page._shown[0].board._bars.content)
    assert f"{record.cycle.measured_rad[cycle, 0]:.2f}" in bars
    assert f"{abs(record.cycle.current_a[cycle, 0]):.2f}" in bars
    time_s, goal, measured = page._shown[0].board._angle.data
    assert time_s[-1] == record.cycle.time_s[cycle]
    assert goal[-1] == record.cycle.sent_rad[cycle, 0]
    assert measured[-1] == record.cycle.measured_rad[cycle, 0]


def test_two_logs_begin_together_and_stand_beside_each_other(record: RunRecord) -> None:
    late = record.cycle.time_s + 100.0
    cut = len(late) // 2
    cycle = replace(record.cycle, time_s=late)
    pose = replace(record.pose, time_s=record.pose.time_s + 100.0)
    slow = replace(record.slow, time_s=record.slow.time_s + 100.0)
    other = replace(record, cycle=cycle, pose=pose, slow=slow)
    page = LogPage({"one": record, "other": other}, "127.0.0.1", 0)
    page._slider.value = round(float(record.cycle.time_s[cut]) + 0.005, 3)
    page.step(0.05, 0.0)
    one, two = (re.sub("<[^>]*>", " ", each.board._bars.content) for each in page._shown)
    assert one == two
    scenes = [each.scene for each in page._shown]
    np.testing.assert_array_equal(
        scenes[0]._body.batched_positions, scenes[1]._body.batched_positions
    )
    assert not page._apart.value  # type: ignore[union-attr]  # the same ground
    page._apart.value = True  # type: ignore[union-attr]
    page.step(0.05, 0.1)
    wide_m = np.ptp(record.pose.centre_m[:, 1])
    between_m = scenes[0]._frame.position[1] - scenes[1]._frame.position[1]
    assert between_m >= wide_m + 0.5 - 1e-9
    page.server.stop()


@pytest.mark.parametrize("world", ["pegs", "pipe", "corridor", "pool"])
def test_obstacles_and_water_are_drawn_where_the_body_meets_them(
    record: RunRecord, world: str
) -> None:
    made = load_world(world)
    page = LogPage(
        {"log": replace(record, header=replace(record.header, world=made, ground=None))},
        "127.0.0.1",
        0,
    )
    handles = page.server.scene._handle_from_node_name
    if made.obstacle is None:
        surface_m = water_surface_m(made, None)
        assert surface_m is not None
        np.testing.assert_allclose(handles["/run0/water"].position, surface_m[0])
    else:
        corners = handles["/run0/obstacle"].vertices
        parts = solids(made.obstacle)
        reach = [np.abs(part.axes) @ _half_m(part) for part in parts]
        low = np.min([part.centre_m - each for part, each in zip(parts, reach, strict=True)], 0)
        np.testing.assert_allclose(corners.min(axis=0), low, atol=1e-6)
    page.server.stop()


def _half_m(part: Solid) -> np.ndarray:
    if part.kind == "box":
        return np.array(part.half_m)
    radius_m, half_m = part.half_m
    return np.array([radius_m, radius_m, half_m])


def test_legs_move_with_their_joints(record: RunRecord) -> None:
    robot = load_robot("salamander")
    page = LogPage(
        {"log": replace(record, header=replace(record.header, robot=robot))}, "127.0.0.1", 0
    )
    scene = page._shown[0].scene
    scene.show(record, 7, 7, follow=False, goals=False)
    pose = BodyPose(0.0, record.pose.head_m[7], record.pose.rotation[7])
    angles = np.nan_to_num(record.cycle.measured_rad[7])
    ends_m = leg_segments_m(robot, body_in_world(robot, pose, angles), angles)
    legs = scene._legs
    assert legs is not None
    np.testing.assert_allclose(legs.batched_positions, ends_m.mean(axis=1), atol=1e-6)
    turn = Rotation.from_quat(legs.batched_wxyzs, scalar_first=True)
    along = ends_m[:, 1] - ends_m[:, 0]
    lengths_m = np.linalg.norm(along, axis=1, keepdims=True)
    np.testing.assert_allclose(turn.apply([1.0, 0.0, 0.0]), along / lengths_m, atol=1e-5)
    page.server.stop()


def test_a_time_without_a_fact_has_no_comma(record: RunRecord) -> None:
    """A gait on the floor showed "47.8 s," until its speed was known."""
    none = replace(record, waypoints=((0.0, np.zeros((0, 2))),))
    page = LogPage({"log": none}, "127.0.0.1", 0)
    page.step(0.05, 0.0)
    page.server.stop()
    assert re.search(r" s +pose:", state(page))


def test_texts_of_a_log_steer_no_page(record: RunRecord) -> None:
    run = record.header.run.model_copy(update={"name": "<img src=x onerror=alert(1)>"})
    named = replace(record, header=replace(record.header, run=run))
    page = LogPage({"log": named}, "127.0.0.1", 0)
    page.step(0.05, 0.0)
    page.server.stop()
    assert "<img" not in page._shown[0].board._state.content


def test_a_log_without_a_cycle_is_refused(record: RunRecord) -> None:
    empty = record_of({}, complete=True, note="", header=record.header)
    with pytest.raises(InputError, match="nothing to show"):
        LogPage({"log": empty}, "127.0.0.1", 0)


def test_the_command_refuses_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for words in (
        ["nothing.mcap"],
        ["a.mcap", "b.mcap", "c.mcap"],
        [str(tmp_path), "--view-at", "here:there"],
    ):
        monkeypatch.setattr("sys.argv", ["snakewalk", "view", *words])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 2
        assert len(capsys.readouterr().err.splitlines()) == 1


def test_the_first_camera_frames_the_body(page: LogPage, record: RunRecord) -> None:
    page.step(0.05, 0.0)
    camera, length_m = page.server.initial_camera, record.header.robot.length_m
    centre_m = record.pose.centre_m[0] * [0.0, 0.0, 1.0]  # the page follows the body
    assert np.linalg.norm(np.array(camera.look_at) - centre_m) < 0.3 * length_m
    assert np.linalg.norm(np.array(camera.position) - centre_m) < 1.2 * length_m
    assert camera.position[2] > centre_m[2] + 0.3 * length_m


def test_the_body_of_a_run_with_waypoints_stays_in_the_picture(
    page: LogPage, record: RunRecord
) -> None:
    assert record.header.run.waypoints_m
    page.step(0.05, 0.0)
    shown = page._shown[0]
    shown.draw(float(record.cycle.time_s[-1]), curves=False)
    links_m = np.asarray(shown.scene._body.batched_positions)
    centre_m = links_m.mean(axis=0) + shown.scene._frame.position
    assert np.hypot(*links_m.mean(axis=0)[:2]) > 0.2 * record.header.robot.length_m
    assert np.hypot(*centre_m[:2]) < 0.1 * record.header.robot.length_m
    shown.board.follow.value = False
    shown.draw(float(record.cycle.time_s[-1]), curves=False)
    np.testing.assert_array_equal(shown.scene._frame.position, 0.0)


def test_contours_lie_on_the_ground_at_round_heights() -> None:
    y, x = np.mgrid[0.0:3.0:31j, 0.0:4.0:41j]
    field = HeightField(0.3 * np.sin(2.0 * x) * np.cos(1.5 * y), 0.1, 0.0, 0.0)
    step_m = contour_step_m(field)
    assert step_m == pytest.approx(0.05)
    pieces_m = contours_m(field, step_m)
    levels = pieces_m[..., 2] / step_m
    np.testing.assert_allclose(levels, np.rint(levels), atol=1e-9)
    assert set(np.rint(levels).astype(int).ravel()) == set(range(-5, 6))
    middle_m = pieces_m.mean(axis=1)
    np.testing.assert_allclose(
        field.elevation_m(middle_m[:, 0], middle_m[:, 1]), middle_m[:, 2], atol=0.006
    )
    assert len(contours_m(HeightField(np.zeros((4, 4)), 0.1, 0.0, 0.0), 0.05)) == 0


@pytest.mark.parametrize("is_measured", [True, False])
def test_the_page_states_how_the_pose_is_known(record: RunRecord, is_measured: bool) -> None:
    evidence = SIMULATED if is_measured else PoseEvidence(Kind.DEAD_RECKONED, "joints")
    known = replace(record, header=replace(record.header, pose_evidence=evidence))
    page = LogPage({"log": known}, "127.0.0.1", 0)
    page.step(0.05, 0.0)
    assert f"pose: {evidence.text}" in state(page)
    assert ("believed: waypoint 1 of 4" in state(page)) != is_measured
    assert {each.wireframe for each in page._shown[0].scene._waypoints} == {not is_measured}
    page.server.stop()
