"""The overhead camera above known ground that is not level."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("cv2")

from snakewalk.config.camera import CameraConfig
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.controller.cameras.camera_source import OverheadCameraPose
from snakewalk.controller.cameras.ground_rest import GroundRest, heights_of
from snakewalk.controller.cameras.overhead_camera import CameraModel
from snakewalk.controller.kinematics.links import body_in_world

CAMERA = CameraConfig(field_width_m=4.0, height_m=4.0)
ROBOT = load_robot("alternating16")


@pytest.fixture(scope="module")
def ramp() -> HeightField:
    ground = build_ground(load_world("ramp-10"))
    assert ground is not None
    return ground


@pytest.mark.parametrize("world", ["ramp-10", "jacksboro-gentle"])
def test_the_ray_of_a_pixel_meets_the_ground(world: str) -> None:
    ground = build_ground(load_world(world))
    level = CameraModel.straight_down(CAMERA, (0.0, 0.0))
    model = replace(level, heights=heights_of(ground))
    rng = np.random.default_rng(2)
    px = rng.uniform((40.0, 40.0), (600.0, 440.0), (50, 2))
    places = model.on_plane(px, 0.03)
    assert model.in_image(places, 0.03) == pytest.approx(px, abs=0.2)
    # a pinhole above the middle: the same pixel as that of the point in space
    height = ground.elevation_m(*places.T) + 0.03  # type: ignore[union-attr]
    pinhole = places * (CAMERA.height_m / (CAMERA.height_m - height))[:, None]
    assert level.on_plane(px, 0.0) == pytest.approx(pinhole, abs=2e-3)
    assert np.abs(height).max() > 0.1


def test_a_line_that_was_not_found_stays_unknown(ramp: HeightField) -> None:
    model = CameraModel.straight_down(CAMERA, (0.0, 0.0))
    model = replace(model, heights=heights_of(ramp))
    assert np.isnan(model.on_plane(np.full((101, 2), np.nan), 0.03)).all()


def test_as_if_the_ground_were_level_the_place_would_be_wrong(ramp: HeightField) -> None:
    level = CameraModel.straight_down(CAMERA, (0.0, 0.0))
    model = replace(level, heights=heights_of(ramp))
    px = np.array([[560.0, 100.0]])
    assert np.linalg.norm(model.on_plane(px, 0.03) - level.on_plane(px, 0.03)) > 0.1


def test_a_body_lies_along_the_slope(ramp: HeightField) -> None:
    joint_rad = np.where(np.arange(16) % 2 == 0, 0.5, 0.0)
    rest = GroundRest(ROBOT, heights_of(ramp))
    for heading in (0.0, 1.0, np.pi / 2, 3.0):
        pose = rest.pose(np.array([0.6, 0.1, heading]), joint_rad, 1.5)
        body = body_in_world(ROBOT, pose, joint_rad)
        on_plane = np.abs(body.link_m[:, 0]) < 1.2  # of the ramp
        above = body.link_m[:, 2] - ramp.elevation_m(*body.link_m[:, :2].T)
        assert above[on_plane] == pytest.approx(ROBOT.body_radius_m, abs=0.012)
        forward = pose.rotation[:, 0]
        assert np.arctan2(forward[1], forward[0]) == pytest.approx(heading, abs=1e-9)
        assert pose.head_in_world_m[:2] == pytest.approx([0.6, 0.1])
        assert pose.time_s == 1.5


def test_on_a_level_floor_the_body_is_level() -> None:
    pose = GroundRest(ROBOT, None).pose(np.array([1.0, 2.0, 0.3]), np.zeros(16), 0.0)
    assert pose.head_in_world_m.tolist() == [1.0, 2.0, ROBOT.body_radius_m]
    assert pose.rotation[:, 2].tolist() == [0.0, 0.0, 1.0]


def test_a_straight_body_takes_the_slope_along_itself_only(ramp: HeightField) -> None:
    pose = GroundRest(ROBOT, heights_of(ramp)).pose(
        np.array([0.8, 0.0, np.pi / 2]), np.zeros(16), 0.0
    )
    assert pose.rotation[:, 2] == pytest.approx([0.0, 0.0, 1.0], abs=0.01)


@pytest.mark.parametrize(
    ("world", "why"),
    [("ramp-10", None), ("jacksboro-gentle", None), ("pool", "water"), ("pegs", "obstacle")],
)
def test_known_hills_are_accepted_and_water_is_not(world: str, why: str | None) -> None:
    run = load_run("flat-slalom").model_copy(update={"camera": CAMERA})
    faults = OverheadCameraPose().faults(run, ROBOT, load_world(world), on_port=False)
    assert ([] if why is None else [why]) == [why for fault in faults if why and why in fault]
    assert bool(faults) == (why is not None)
