"""The pose of the head from pictures of tags on the links, on slopes and with noise."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("cv2")

from pydantic import ValidationError

from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.config.pose import PoseConfig
from snakewalk.config.tags import FixedTag, TagMount, TagsConfig
from snakewalk.controller.cameras.tags.tag_camera import DrawnTags
from snakewalk.controller.cameras.tags.tag_detector import TagDetector, TagPicture, tag_dictionary
from snakewalk.controller.cameras.tags.tag_fit import TagFit
from snakewalk.controller.cameras.tags.tag_source import TagFeed, TagsPose
from snakewalk.controller.cameras.tags.tag_view import TagView
from snakewalk.controller.pose.dead_reckoning import DeadReckoning
from snakewalk.controller.pose.external_pose import ExternalPose
from snakewalk.controller.pose.sample import PoseSample, UnusablePoseError, turned
from snakewalk.drivers.types import JointState
from tests.controller.cameras.tag_scene import ASLANT, Scene, error, joints, on_slope, tagged

SLOPES = [(0.0, 0.0, 0.0), (4.0, -12.0, 20.0), (-15.0, 8.0, -60.0), (20.0, 0.0, 90.0)]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene()


@pytest.mark.parametrize("slope", SLOPES, ids=str)
def test_the_head_is_found_on_slopes_with_an_honest_covariance(
    scene: Scene, slope: tuple[float, float, float]
) -> None:
    head, joint_rad = on_slope(*slope), joints(scene.robot, seed=int(abs(slope[2])))
    found = scene.found(head, joint_rad)
    assert found is not None
    away_m, angle_rad = error(found, head)
    assert away_m < 4.0 * np.sqrt(np.trace(found.covariance[:3, :3]))
    spread = np.sqrt(found.covariance.diagonal())
    off = np.abs(found.position_m - head.head_in_world_m) / spread[:3]
    assert off.max() < 4.0
    assert angle_rad < 4.0 * spread[3:].max()
    assert spread[:3].max() < 0.02


def test_corners_with_noise_stay_within_the_covariance(scene: Scene) -> None:
    head, joint_rad = on_slope(3.0, -10.0, 15.0), joints(scene.robot, 4, 0.3)
    rng, squares = np.random.default_rng(1), []
    for _ in range(20):
        noisy = {n: at + rng.normal(0.0, 0.5, (4, 2)) for n, at in exact(scene, head, joint_rad)}
        found = scene.fit.fit(noisy, joint_rad)
        assert found is not None
        gap = found.position_m - head.head_in_world_m
        squares.append(gap @ np.linalg.solve(found.covariance[:3, :3], gap))
    assert 0.5 < np.mean(squares) < 4.5  # 3 of an exact covariance; the shared error is added


def exact(scene: Scene, head: object, joint_rad: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Corners without noise of each tag."""
    from snakewalk.controller.cameras.tags.tag_fit import tag_corners
    from snakewalk.controller.kinematics.links import body_in_world

    body = body_in_world(scene.robot, head, joint_rad)  # type: ignore[arg-type]
    assert scene.robot.tags is not None
    return [
        (
            tag.id,
            scene.view.pixels(
                body.link_m[tag.link]
                + tag_corners(tag, scene.robot.tags.side_m) @ body.rotation[tag.link].T
            ),
        )
        for tag in scene.robot.tags.on
    ]


def test_the_two_poses_of_a_single_tag_are_told_apart_by_the_pose_before() -> None:
    far = ASLANT.model_copy(update={"place_m": (-0.4, -0.6, 3.5), "height_m": 3.6})
    scene = Scene(camera=far)
    head, joint_rad = on_slope(-20.0, 15.0, 0.0), joints(scene.robot, 2, 0.2)
    rng, flipped = np.random.default_rng(3), 0
    number, at = exact(scene, head, joint_rad)[0]
    for _ in range(25):
        noisy = {number: at + rng.normal(0.0, 0.4, (4, 2))}
        good = scene.fit.fit(noisy, joint_rad, head.rotation)
        assert good is not None
        other = scene.fit.fit(noisy, joint_rad, turned((45.0, -28.0, 0.0)))
        assert other is not None
        assert error(good, head)[1] <= error(other, head)[1] + 1e-9
        flipped += error(other, head)[1] > error(good, head)[1] + 0.05
    assert flipped > 3  # the picture of one tag does leave two poses


def test_the_chain_tells_the_two_poses_of_its_tags_apart() -> None:
    far = ASLANT.model_copy(update={"place_m": (-0.4, -0.6, 3.5), "height_m": 3.6})
    scene = Scene(camera=far)
    head, joint_rad = on_slope(-20.0, 15.0, 0.0), joints(scene.robot, 2, 0.5)
    rng = np.random.default_rng(3)
    for _ in range(15):
        noisy = {n: at + rng.normal(0.0, 0.4, (4, 2)) for n, at in exact(scene, head, joint_rad)}
        found = scene.fit.fit(noisy, joint_rad, turned((45.0, -28.0, 0.0)))  # a wrong pose before
        assert found is not None
        assert error(found, head)[1] < 0.12


def test_a_tag_that_slipped_is_left_out(scene: Scene) -> None:
    head, joint_rad = on_slope(), joints(scene.robot, 5, 0.3)
    corners = dict(exact(scene, head, joint_rad))
    number = next(iter(corners))
    corners[number] = corners[number] + 25.0
    found = scene.fit.fit(corners, joint_rad)
    assert found is not None
    assert number not in found.tags
    assert len(found.tags) == len(corners) - 1
    assert error(found, head)[0] < 1e-6


def test_tags_that_do_not_fit_the_joints_give_no_pose(scene: Scene) -> None:
    corners = dict(exact(scene, on_slope(), joints(scene.robot, 5, 0.3)))
    number = next(iter(corners))
    only = {number: corners[number] + [[0, 0], [0, 0], [0, 0], [40, 0]]}
    assert scene.fit.fit(only, joints(scene.robot)) is None
    assert scene.fit.fit({}, joints(scene.robot)) is None


def test_fixed_tags_place_the_camera() -> None:
    fixed = tuple(
        FixedTag(id=k, place_m=(x, y, 0.1 * x), side_m=0.15)
        for k, (x, y) in enumerate([(-1.0, 0.4), (0.2, 0.5), (-0.4, -0.4)], start=40)
    )
    robot = tagged()
    truth = TagView.of(ASLANT)
    picture = DrawnTags(robot, truth, fixed).picture(on_slope(), joints(robot))
    seen = TagDetector("4X4_50", [40, 41, 42]).find(picture)
    unplaced = TagView.of(ASLANT.model_copy(update={"place_m": None, "aim_m": None}))
    assert not unplaced.is_placed
    view = unplaced.placed_by(seen, fixed, 0.05)
    assert np.linalg.norm(view.place_m - truth.place_m) < 0.02
    assert np.arccos(0.5 * (np.trace(view.rotation.T @ truth.rotation) - 1.0)) < 0.01
    with pytest.raises(InputError, match="none is in the picture; show tag 40, 41, 42"):
        unplaced.placed_by({7: seen[40]}, fixed, 0.05)
    moved = (fixed[0].model_copy(update={"place_m": (0.5, 1.4, 0.0)}), *fixed[1:])
    with pytest.raises(InputError, match="do not fit the picture; measure them again"):
        unplaced.placed_by(seen, moved, 0.05)


def test_a_distorted_lens_is_undone(scene: Scene) -> None:
    lens = replace(scene.view.lens, distortion=np.array([-0.25, 0.08, 0.001, -0.001, 0.0]))
    view = replace(scene.view, lens=lens)
    head, joint_rad = on_slope(2.0, -9.0, 10.0), joints(scene.robot, 3, 0.3)
    bent = Scene()
    bent.view = view
    corners = dict(exact(bent, head, joint_rad))
    found = TagFit(scene.robot, view).fit(corners, joint_rad)
    assert found is not None
    assert error(found, head)[0] < 1e-4
    straight = scene.fit.fit(corners, joint_rad)
    assert straight is None or error(straight, head)[0] > 0.005


class Pictures:
    """Pictures that a test hands over."""

    def __init__(self) -> None:
        self.waiting: list[TagPicture] = []

    def arrived(self, now_s: float) -> list[TagPicture]:
        taken, self.waiting = self.waiting, []
        return taken

    def close(self) -> None:
        """Nothing is open."""


def test_the_joints_at_the_time_of_the_picture_count(scene: Scene) -> None:
    head = on_slope()
    pictures = Pictures()
    feed = TagFeed(scene.robot, pictures, scene.fit)
    first, then = joints(scene.robot, 1, 0.3), joints(scene.robot, 2, 0.3)
    feed.note(state(scene, 0.0, first))
    feed.note(state(scene, 0.1, then))
    seen = dict(exact(scene, head, 0.5 * (first + then)))
    pictures.waiting = [TagPicture(0.05, seen)]
    (arrived,) = feed.arrived(0.1)
    assert isinstance(arrived.sample, PoseSample)
    assert arrived.sample.position_m == pytest.approx(head.head_in_world_m, abs=1e-4)
    assert feed.facts() == {"pictures": 1, "tags_per_pose": 6.0}


def state(scene: Scene, time_s: float, angles: np.ndarray) -> JointState:
    """A state of the joints."""
    none, no = np.zeros(scene.robot.joint_count), np.zeros(scene.robot.joint_count, np.uint8)
    return JointState(time_s, angles, none, none, none, none, no, no, none, no == 0, none)


def test_pictures_without_tags_are_a_missing_pose_and_the_run_holds(scene: Scene) -> None:
    pictures = Pictures()
    feed = TagFeed(scene.robot, pictures, scene.fit)
    said: list[str] = []
    config = PoseConfig(latency_s=0.0, frame="world", max_age_s=0.3)
    still = joints(scene.robot, 1, 0.3)
    reckoning = DeadReckoning(scene.robot, load_world("flat").friction, (0.0, 0.0), 0.0)
    pose = ExternalPose(scene.robot, config, feed, reckoning, said.append)
    seen = dict(exact(scene, on_slope(), still))
    for k in range(40):
        time_s = 0.02 * k
        now = state(scene, time_s, still)
        feed.note(now)
        pictures.waiting = [TagPicture(time_s, seen if k < 10 else {})]
        found = pose(now)
    assert found.head_in_world_m == pytest.approx([0.1, 0.05, 0.06], abs=0.01)
    assert pose.fault() is not None
    assert "no tag is in the picture; uncover the tags" in str(pose.fault())
    assert len(said) == 1
    pictures.waiting = [TagPicture(0.8, {})]
    assert isinstance(feed.arrived(0.8)[0].sample, UnusablePoseError)


@pytest.mark.parametrize(
    ("tags", "camera", "on_port", "why"),
    [
        (False, ASLANT, False, "robot alternating16 has no tags; add a table [tags]"),
        (True, CameraConfig(), False, "set camera.place_m and camera.aim_m"),
        (True, ASLANT, True, "camera.device is missing"),
        (True, ASLANT, True, "camera.lens is missing; calibrate it"),
    ],
)
def test_missing_parts_are_named(tags: bool, camera: CameraConfig, on_port: bool, why: str) -> None:
    robot = tagged() if tags else load_robot("alternating16")
    run = load_run("ramp-10-up").model_copy(update={"camera": camera, "pose": "tags"})
    faults = TagsPose().faults(run, robot, load_world("ramp-10"), on_port=on_port)
    assert any(why in fault for fault in faults)


def test_a_dictionary_and_numbers_that_do_not_exist_are_rejected() -> None:
    with pytest.raises(InputError, match="OpenCV has no DICT_9X9"):
        tag_dictionary("9X9")
    with pytest.raises(InputError, match="tag 50: 4X4_50 has the numbers 0 to 49"):
        TagDetector("4X4_50", [50])
    mount = TagMount(id=1, link=0, offset_m=(0.0, 0.0, 0.03))
    with pytest.raises(ValidationError, match="tag 1 is named twice"):
        TagsConfig(on=(mount, mount))
    with pytest.raises(ValidationError, match="place_m and aim_m are given together"):
        CameraConfig(place_m=(0.0, 0.0, 1.0))
