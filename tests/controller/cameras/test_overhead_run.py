"""Runs that close their loop over the camera; refusals; a device that is a film."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.device_camera import DeviceCamera
from snakewalk.controller.cameras.overhead_camera import CameraModel
from snakewalk.controller.kinematics.links import pose_at
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.drivers.clock import WallClock
from snakewalk.sim.rendering.offscreen import OffscreenError
from snakewalk.sim.rendering.top_view import TopView
from tests.helpers.command import snakewalk
from tests.oracles.overhead_scene import DrawnView


def short(**changes: object) -> WalkRun:
    near = {"waypoints_m": ((0.3, 0.05),), "time_limit_s": 15.0}
    return prepare_walk("flat-square", **near | changes)


SMALL = {"width_px": 320, "height_px": 240, "field_width_m": 3.0, "height_m": 3.0}


@pytest.fixture(scope="module")
def drawn() -> None:
    prepared = short()
    try:
        view = TopView(prepared.robot, prepared.world, CameraConfig(**SMALL), (0.0, 0.0))
    except OffscreenError as error:
        pytest.skip(str(error))
    view.close()


@pytest.mark.nightly("draws and searches a picture in every cycle of a walk")
@pytest.mark.usefixtures("drawn")
def test_a_waypoint_is_reached_by_what_the_camera_sees(tmp_path: Path) -> None:
    small = {"width_px": 384, "height_px": 288, "field_width_m": 3.6, "height_m": 3.6}
    run = short(
        seed=2,
        pose="camera",
        camera=small | {"centre_m": (0.2, 0.0)},
        waypoints_m=((0.9, 0.2),),
        time_limit_s=25.0,
    )
    finished = run_robot(RunRequest(run, tmp_path))
    assert finished.outcome.complete
    found = finished.pose.facts()
    assert found["waypoints_truly_reached"] == 1
    assert found["frames_used"] == found["frames"] > 50
    assert 0.0 < float(str(found["head_error_rms_m"])) < 0.0094, "under a pixel"
    assert float(str(found["heading_error_rms_rad"])) < 0.02
    record = read_log(finished.log)
    assert record.header.run.pose == "camera"
    assert any(event.kind == "pose" for event in record.events)
    stated_m = float(str(finished.summary.evidence["pose_position_sd_m"]))
    assert float(str(found["head_sigma_median_m"])) <= stated_m < 0.0094, "the largest of the run"
    assert float(str(found["head_error_rms_m"])) < 2.0 * stated_m


@pytest.mark.nightly("draws and searches a picture in every cycle: 6 s of CPU")
@pytest.mark.usefixtures("drawn")
def test_a_body_that_leaves_the_image_is_reckoned_on_and_the_log_says_so(tmp_path: Path) -> None:
    small = SMALL | {"centre_m": (-0.62, 0.0), "field_width_m": 1.4}
    finished = run_robot(RunRequest(short(pose="camera", camera=small, time_limit_s=3.0), tmp_path))
    events = [event.text for event in read_log(finished.log).events if event.kind == "camera"]
    assert "lost the body: cut by the edge of the image" in events[0]
    assert finished.pose.facts()["frames_used"] < finished.pose.facts()["frames"]


@pytest.mark.slow
@pytest.mark.usefixtures("drawn")
def test_a_robot_out_of_view_at_its_start_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not completely visible at its start: nothing seen"):
        run_robot(RunRequest(short(pose="camera", camera={"centre_m": (30.0, 0.0)}), tmp_path))


@pytest.mark.slow
@pytest.mark.usefixtures("drawn")
def test_the_rendered_view_agrees_with_the_camera_model() -> None:
    """A pinhole drawn by MuJoCo, turned and off the origin, against the homography."""
    from snakewalk.sim.physics.plant import MujocoPlant

    prepared = short()
    camera = CameraConfig(turn_rad=0.6, field_width_m=4.0, height_m=3.0)
    view = TopView(prepared.robot, prepared.world, camera, (1.0, -0.5))
    plant = MujocoPlant(prepared.robot, prepared.world)
    plant.reset((2.0, 0.3), 0.9, np.zeros(16))
    model = CameraModel.straight_down(camera, (1.0, -0.5))
    change = cv2.absdiff(view.picture(plant.qpos), view.empty_floor()).max(axis=2)
    view.close()
    for place in plant.link_positions_m[1:14]:
        x, y = np.rint(model.in_image(place[:2], float(place[2]))).astype(int)
        assert change[y, x] > 40


@pytest.mark.slow
def test_joints_alone_are_told_to_be_off(tmp_path: Path) -> None:
    finished = run_robot(RunRequest(short(pose="joints", time_limit_s=3.0), tmp_path))
    assert float(str(finished.pose.facts()["head_error_rms_m"])) > 0.0


@pytest.mark.parametrize(
    ("changes", "port", "line"),
    [
        ({"pose": "camera", "world": "pole"}, None, "dry ground without obstacles"),
        ({"pose": "camera", "world": "pool"}, None, "dry ground without obstacles"),
        ({"pose": "simulator"}, "/dev/nosuch", "servos on a port have no simulator"),
        ({"pose": "camera"}, "/dev/nosuch", "camera: device: needed with servos on a port"),
        ({"pose": "camera", "camera": {"height_m": 0.25, "field_width_m": 1.0}}, None, "height_m"),
    ],
)
def test_what_cannot_work_is_refused_before_anything_is_written(
    changes: dict[str, object], port: str | None, line: str, tmp_path: Path
) -> None:
    robot = "robot-thick.toml"
    if "camera" in changes:
        (tmp_path / robot).write_text(
            'name = "thick"\njoint_axes = "yyyyyyyyyyyyyyyy"\nbody_radius_m = 0.07\n'
        )
        changes = changes | {"robot": str(tmp_path / robot)}
    with pytest.raises(InputError, match=line):
        run_robot(RunRequest(short(**changes), tmp_path / "run", port=port))
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("run", "flat-square", "--pose", "sonar"), "pose"),
        (("run", "flat-square", "--world", "pole", "--pose", "camera"), "without obstacles"),
    ],
)
def test_the_command_line_says_what_is_wrong_in_one_line(
    arguments: tuple[str, ...], line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = snakewalk(*arguments)
    assert done.returncode == 2, done.stderr
    said = [text for text in done.stderr.splitlines() if text.startswith("snakewalk: ")]
    assert len(said) == 1
    assert line in said[0]
    assert "Traceback" not in done.stderr


@pytest.fixture
def bench(tmp_path: Path) -> WalkRun:
    """A device that is a film: a robot that lies still, and its empty floor."""
    prepared = short()
    camera = CameraConfig(centre_m=(0.0, 0.0))
    view = DrawnView(prepared.robot, CameraModel.straight_down(camera, (0.0, 0.0)), (640, 480))
    cv2.imwrite(str(tmp_path / "floor.png"), view.empty_floor())
    film = cv2.VideoWriter(
        str(tmp_path / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (640, 480)
    )
    for k in range(5):
        film.write(view.picture(pose_at(np.array([0.5, 0.1]), 0.2), np.full(16, 0.1), k + 1))
    film.release()
    device = camera.model_copy(
        update={
            "device": str(tmp_path / "film.avi"),
            "background": str(tmp_path / "floor.png"),
        }
    )
    run = prepared.run.model_copy(update={"camera": device, "pose": "camera"})
    return WalkRun(run, prepared.robot, prepared.world)


def test_a_device_hands_over_what_it_sees_and_says_when_it_is_gone(bench: WalkRun) -> None:
    camera = DeviceCamera(bench.run, bench.robot, WallClock())
    try:
        found = camera.start
        assert found.status is FrameStatus.GOOD
        reach = 0.5 * bench.robot.mean_link_length_m + bench.robot.body_radius_m
        tip = (0.5 + reach * np.cos(0.2), 0.1 + reach * np.sin(0.2))
        assert np.hypot(*(found.line_m[[0, -1]] - tip).T).min() < 0.012
        said = [_gone(camera) for _ in range(6)]
        assert any("delivers no more frames" in text for text in said)
    finally:
        camera.close()


def _gone(camera: DeviceCamera) -> str:
    camera_text = ""
    try:
        camera.first()
    except InputError as fault:
        camera_text = str(fault)
    return camera_text


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"device": "/nowhere/camera"}, "OpenCV cannot open it"),
        ({"background": "/nowhere/floor.png"}, "No such file"),
        ({"lens": "/nowhere/lens.yml"}, "lens.yml"),
        ({"width_px": 320}, "is 640 x 480 pixels, the camera 320 x 480"),
    ],
)
def test_a_device_that_cannot_be_used_is_refused_in_one_line(
    bench: WalkRun, change: dict[str, object], line: str
) -> None:
    camera = bench.run.camera.model_copy(update=change)
    with pytest.raises(InputError, match=line) as refused:
        DeviceCamera(
            bench.run.model_copy(update={"camera": camera}), bench.robot, WallClock()
        ).close()
    assert len(refused.value.faults) == 1
