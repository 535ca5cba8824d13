"""The overhead camera under faults of light and view: rendered frames, 16 poses each.

``python -m benchmarks disturbed_views``; ``SEED=n`` takes other poses and noise.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np

from benchmarks.rows import Row
from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import PegsObstacle
from snakewalk.controller.cameras.floor_learning import FloorLearning
from snakewalk.controller.cameras.lens import Lens
from snakewalk.controller.cameras.overhead_camera import CameraModel, OverheadDetector
from snakewalk.controller.cameras.pose_tracking import BodyPrior
from snakewalk.controller.cameras.rendered_camera import floor_prints
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.rendering.top_view import TopView

TITLE = "Overhead camera, rendered views with faults: 16 poses each, wrong is over 5 mm and used"

POSES = 16
WRONG_M = 0.005
CAMERA = CameraConfig()
MARKED = CameraConfig(
    markers_m={
        "0": (-2.6, -1.9), "1": (2.6, -1.9), "2": (2.6, 1.9), "3": (-2.6, 1.9), "4": (0.0, 1.9)
    }
)  # fmt: skip
Effect = Callable[[Floats, np.random.Generator, Floats], Floats]
"""(H, W, 3) frame, chance, (2,) pixel of the body's middle -> (H, W, 3) frame."""


def _gain(by: float) -> Effect:
    return lambda frame, chance, at: frame * by


def _gradient(frame: Floats, chance: np.random.Generator, at: Floats) -> Floats:
    """From 0.7 to 1.3 across the picture, in any direction."""
    turn = chance.uniform(0.0, 2.0 * np.pi)
    v, u = np.mgrid[-1.0 : 1.0 : frame.shape[0] * 1j, -1.0 : 1.0 : frame.shape[1] * 1j]
    along = (np.cos(turn) * u + np.sin(turn) * v) / (abs(np.cos(turn)) + abs(np.sin(turn)))
    return np.asarray(frame * (1.0 + 0.3 * along)[..., None])


def _sun(frame: Floats, chance: np.random.Generator, at: Floats) -> Floats:
    """A window's patch, 1.4 times as bright, whose edge crosses the body."""
    patch = np.zeros(frame.shape[:2], np.float32)
    turn = chance.uniform(0.0, 2.0 * np.pi)
    ahead, side = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    near = at + chance.uniform(-20.0, 20.0, 2)
    corners = [near - 90 * side, near + 90 * side, near + 90 * side + 200 * ahead]
    corners.append(near - 90 * side + 200 * ahead)
    cv2.fillPoly(patch, [np.rint(corners).astype(np.int32)], 1.0)
    return frame * (1.0 + 0.4 * cv2.GaussianBlur(patch, (0, 0), 2.0))[..., None]


def _noise(frame: Floats, chance: np.random.Generator, at: Floats) -> Floats:
    """15 grey levels in all: the view has 3 of them already."""
    return frame + chance.normal(0.0, np.sqrt(15.0**2 - 3.0**2), frame.shape)


def _person(frame: Floats, chance: np.random.Generator, at: Floats) -> Floats:
    """Head, shoulders and an arm from an edge, larger than the robot, with a soft shadow."""
    high, wide = frame.shape[:2]
    left = chance.random() < 0.5
    foot = np.array([0.0 if left else wide - 1.0, chance.uniform(0.2, 0.8) * high])
    inward = 1.0 if left else -1.0
    reach = foot + np.array([inward * 110.0, chance.uniform(-60.0, 60.0)])
    away = at - reach
    if np.hypot(*away) < 90.0:  # a hand that does not cover the robot
        reach = at - 90.0 * away / max(float(np.hypot(*away)), 1.0)
    shapes = [(foot, (40, 70)), (foot + np.array([18.0 * inward, 0.0]), (16, 16))]
    shade = np.zeros((high, wide), np.float32)
    out = frame.copy()
    for (x, y), axes in shapes:
        cv2.ellipse(shade, (int(x + 12), int(y + 8)), axes, 0, 0, 360, 1.0, -1)
    out *= 1.0 - 0.3 * cv2.GaussianBlur(shade, (0, 0), 6.0)[..., None]
    for ((x, y), axes), colour in zip(shapes, ((60, 80, 140), (60, 45, 35)), strict=True):
        cv2.ellipse(out, (int(x), int(y)), axes, 0, 0, 360, colour, -1)
    hand = tuple(np.rint(reach).astype(int).tolist())
    cv2.line(out, tuple(np.rint(foot).astype(int).tolist()), hand, (205, 160, 135), 12)
    return out


def _shift(frame: Floats, chance: np.random.Generator, at: Floats) -> Floats:
    turn = chance.uniform(0.0, 2.0 * np.pi)
    move = np.array([[1.0, 0.0, 4.0 * np.cos(turn)], [0.0, 1.0, 4.0 * np.sin(turn)]])
    return np.asarray(
        cv2.warpAffine(frame, move, frame.shape[1::-1], borderMode=cv2.BORDER_REPLICATE)
    )


EFFECTS: dict[str, Effect] = {
    "as it is": _gain(1.0),
    "light x 0.65": _gain(0.65),
    "light x 0.9": _gain(0.9),
    "light x 1.1": _gain(1.1),
    "light x 1.5": _gain(1.5),
    "gradient of 30 %": _gradient,
    "sun patch": _sun,
    "noise of 15": _noise,
    "person at the edge": _person,
    "shift of 4 px": _shift,
}


def _turned(axis: tuple[float, float, float], degrees: float) -> Effect:
    """The camera turned about an axis of its picture through the lens, either way by chance."""

    def effect(frame: Floats, chance: np.random.Generator, at: Floats) -> Floats:
        matrix = _lens(0.0).matrix
        by = np.radians(degrees) * chance.choice([-1.0, 1.0]) * np.array(axis)
        turn, _ = cv2.Rodrigues(by)
        move = matrix @ turn @ np.linalg.inv(matrix)
        size = frame.shape[1::-1]
        return np.asarray(cv2.warpPerspective(frame, move, size, borderMode=cv2.BORDER_REPLICATE))

    return effect


def _kicked(frame: Floats, chance: np.random.Generator, at: Floats) -> Floats:
    """The marker in a corner moved by 6 px over the floor, the camera where it was."""
    out = frame.copy()
    out[28:58, 34:64] = frame[28:58, 28:58]
    return out


BUMPS: dict[str, Effect] = {
    "turned by 1 degree": _turned((0.0, 0.0, 1.0), 1.0),
    "tilted by 1 degree": _turned((0.6, 0.8, 0.0), 1.0),
    "one marker moved": _kicked,
}
"""What only markers tell."""


MINUTES = 10
_STEP_S = 5.0
_STANDS_S = 300.0
_BAR_LIGHT = 0.35  # of the light is left in a bar's shadow: more is taken than ``shade`` explains
_BAR_M, _BARS_M, _SUN_M_S = 0.08, 0.5, 13e-3 / 60.0
_CRATE_M, _CRATE_HIGH_M = 0.35, 0.06


def _bars(frame: Floats, time_s: float) -> Floats:
    """Hard shadows of a window's bars, which wander as the sun does on a floor 3 m away from it."""
    metre = frame.shape[1] / CAMERA.field_width_m
    v, u = np.mgrid[0.0 : frame.shape[0], 0.0 : frame.shape[1]]
    along = (u + 0.4 * v) / np.hypot(1.0, 0.4) / metre - _SUN_M_S * time_s
    return np.asarray(frame * np.where(along % _BARS_M < _BAR_M, _BAR_LIGHT, 1.0)[..., None])


@dataclass(frozen=True)
class Scene:
    picture: Image
    qpos: Floats
    joint_rad: Floats
    head_m: Floats
    heading_rad: float


@dataclass(frozen=True)
class Found:
    used: int
    wrong: int
    head_max_m: float
    noticed: int
    """Frames in which a bump was told."""


@dataclass(frozen=True)
class Stay:
    """So long in one pose; its last frame may be judged."""

    scene: Scene
    lasts_s: float
    judged: bool = True


def scenes(seed: int, camera: CameraConfig) -> tuple[list[Scene], Image]:
    """Poses of a walk's shapes anywhere in the view, and the empty floor."""
    robot, world = load_robot("yaw16"), load_world("flat")
    chance = np.random.default_rng(seed)
    view = TopView(robot, world, camera, (0.0, 0.0), seed, floor_prints(camera))
    plant = MujocoPlant(robot, world)
    found = []
    for _ in range(POSES):
        bend = chance.uniform(0.15, 0.5) * np.sin(
            chance.uniform(0.0, 6.3) + chance.uniform(0.4, 0.8) * np.arange(robot.joint_count)
        ) + chance.uniform(-0.05, 0.05)
        heading = float(chance.uniform(-np.pi, np.pi))
        where = chance.uniform((-1.9, -1.2), (1.9, 1.2))
        back = 0.5 * robot.length_m * np.array([np.cos(heading), np.sin(heading)])
        start = where + back
        plant.reset((float(start[0]), float(start[1])), heading, bend)
        pose = plant.head_pose()
        body = body_in_world(robot, pose, bend)
        found.append(
            Scene(
                view.picture(plant.qpos).copy(),
                plant.qpos.copy(),
                bend,
                pose.head_in_world_m[:2].copy(),
                float(body.headings_rad[0]),
            )
        )
    floor = view.empty_floor().copy()
    view.close()
    return found, floor


def run() -> list[Row]:
    """Measure."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    seed = int(os.environ.get("SEED", "1000"))
    try:
        drawn, floor = scenes(seed, CAMERA)
        rows = []
        for name, effect in EFFECTS.items():
            rows += _told(name, measure(drawn, floor, effect, CAMERA, None))
        for k1 in (-0.1, -0.3):
            rows += _told(f"k1 = {k1:g}", measure(drawn, floor, _gain(1.0), CAMERA, _lens(k1)))
        for name, runs in in_time(drawn, seed).items():
            for learn_s in (0.0, CAMERA.learn_s):
                how = f"learnt in {learn_s:g} s" if learn_s else "as pictured"
                found = measure_in_time(runs, floor, learn_s, bars="bars" in name)
                rows += _told(f"{name}, floor {how}", found)
        drawn, floor = scenes(seed, MARKED)
        for name, effect in (EFFECTS | BUMPS).items():
            found = measure(drawn, floor, effect, MARKED, None)
            rows += _told(f"with markers, {name}", found)
            bumped = name in BUMPS or name == "shift of 4 px"
            right = found.noticed if bumped else POSES - found.noticed
            rows.append(
                Row(f"with markers, {name}: bump told rightly, of {POSES}", right, "frames", "16",
                    POSES / max(right, 1), 1.0)
            )  # fmt: skip
        for name in ("turned by 1 degree", "tilted by 1 degree"):
            found = measure(drawn, floor, BUMPS[name], MARKED, _lens(-0.3))
            rows += _told(f"with markers, k1 = -0.3, {name}", found)
        return rows
    finally:
        cv2.setNumThreads(threads)


def _lens(k1: float) -> Lens:
    focal = CAMERA.width_px * CAMERA.height_m / CAMERA.field_width_m
    middle = 0.5 * (CAMERA.width_px - 1), 0.5 * (CAMERA.height_px - 1)
    matrix = np.array([[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]])
    return Lens((CAMERA.width_px, CAMERA.height_px), matrix, np.array([k1, 0.0, 0.0, 0.0, 0.0]))


def _whole(frame: Floats) -> Image:
    return np.clip(np.rint(frame), 0.0, 255.0).astype(np.uint8)


def _bent(frame: Image, lens: Lens | None) -> Image:
    """The frame as the lens would have made it."""
    if lens is None:
        return frame
    u, v = np.meshgrid(*(np.arange(side, dtype=float) for side in frame.shape[1::-1]))
    at = lens.undistorted(np.stack([u, v], axis=-1)).astype(np.float32)
    bent = cv2.remap(
        frame, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(bent, dtype=np.uint8)


def measure(
    drawn: list[Scene], floor: Image, effect: Effect, camera: CameraConfig, lens: Lens | None
) -> Found:
    """Track each pose from a belief that is off by up to 40 mm each way and 0.1 rad."""
    robot, ground = load_robot("yaw16"), _bent(floor, lens)
    model = CameraModel.of_floor(camera, (0.0, 0.0), lens, ground)
    detector = OverheadDetector(model, ground, robot.body_radius_m, camera.shade)
    off_m, noticed = [], 0
    for k, scene in enumerate(drawn):
        chance = np.random.default_rng((k, 7))
        body = body_in_world(robot, pose_at(scene.head_m, scene.heading_rad), scene.joint_rad)
        at = model.in_image(body.link_m[:, :2].mean(axis=0), robot.body_radius_m)
        if effect in BUMPS.values():  # before the lens
            image = _bent(_whole(effect(scene.picture.astype(float), chance, at)), lens)
        else:
            image = _whole(effect(_bent(scene.picture, lens).astype(float), chance, at))
        prior = belief(scene, robot, chance)
        found = detector.registered(image).track(image, 0.0, prior, robot)
        noticed += found.bump is not None
        if not found.fault:
            off_m.append(float(np.hypot(*(found.head_m - scene.head_m))))
    wrong = sum(d > WRONG_M for d in off_m)
    return Found(len(off_m), wrong, max(off_m, default=float("nan")), noticed)


def in_time(drawn: list[Scene], seed: int) -> dict[str, list[list[Stay]]]:
    """What the floor must learn, and must not: runs through poses, by name."""
    stays, taken, still = [], [], []
    for k, scene in enumerate(drawn):
        away, here = _with_crate(scene, drawn, seed)
        before = Stay(away, _STANDS_S, judged=False)
        stays.append([before, Stay(here, _STEP_S)])
        taken.append([before, Stay(scene, _STEP_S)])
        here_first = Stay(scene, _STANDS_S, judged=False)
        still.append([here_first, Stay(drawn[(k + 1) % POSES], _STEP_S)])
    return {
        "shadows of bars wander for 10 minutes": [
            [Stay(scene, 60.0 * MINUTES / POSES) for scene in drawn]
        ],
        "a crate is put down and stays": stays,
        "a crate that stood for 5 minutes is taken away": taken,
        "the robot stands still for 5 minutes": still,
    }


def measure_in_time(runs: list[list[Stay]], floor: Image, learn_s: float, *, bars: bool) -> Found:
    """Track each pose after minutes of injected time, a frame every few seconds."""
    robot = load_robot("yaw16")
    model = CameraModel.of_floor(CAMERA, (0.0, 0.0), None, floor)
    noise = np.random.default_rng(8).normal(0.0, 3.0, (5, *floor.shape)).astype(np.float32)
    off_m = []
    for k, run in enumerate(runs):
        detector = OverheadDetector(model, floor, robot.body_radius_m, CAMERA.shade)
        learning, now_s = FloorLearning(robot, learn_s), 0.0
        chance = np.random.default_rng((k, 8))
        for stay in run if learn_s else [one for one in run if one.judged]:
            scene = stay.scene
            for n in range(round(stay.lasts_s / _STEP_S)):
                now_s += _STEP_S
                frame = scene.picture + noise[n % len(noise)]
                image = _whole(_bars(frame, now_s) if bars else frame)
                prior = belief(scene, robot, chance)
                found = detector.track(image, now_s, prior, robot)
                detector = learning.after(detector, image, prior, found)
            if stay.judged and not found.fault:
                off_m.append(float(np.hypot(*(found.head_m - scene.head_m))))
    wrong = sum(d > WRONG_M for d in off_m)
    return Found(len(off_m), wrong, max(off_m, default=float("nan")), 0)


def belief(scene: Scene, robot: RobotConfig, chance: np.random.Generator) -> BodyPrior:
    """Off by up to 40 mm each way and 0.1 rad."""
    believed = pose_at(
        scene.head_m + chance.uniform(-0.04, 0.04, 2),
        scene.heading_rad + float(chance.uniform(-0.1, 0.1)),
    )
    guess = body_in_world(robot, believed, scene.joint_rad)
    return BodyPrior(guess.link_m[:, :2], guess.forward[:, :2])


def _with_crate(scene: Scene, drawn: list[Scene], seed: int) -> tuple[Scene, Scene]:
    """The pose furthest from a round crate, and the given one, which the crate is beside."""
    robot = load_robot("yaw16")
    links_m = _links(scene, robot)
    middle = len(links_m) // 2
    ahead = links_m[middle - 3] - links_m[middle + 3]
    side = np.array([-ahead[1], ahead[0]]) / np.hypot(*ahead)
    near_m = _CRATE_M + robot.body_radius_m
    ways = links_m[middle] + np.arange(near_m, 2.0, 0.005)[:, None] * side
    crate_m = next(at for at in ways if _apart_m(links_m, at) >= near_m)
    away = max(drawn, key=lambda one: _apart_m(_links(one, robot), crate_m))
    crate = PegsObstacle(
        radius_m=_CRATE_M, height_m=_CRATE_HIGH_M, spacing_m=1.0, rows=1, row_pegs=1,
        pattern="square", at_m=(float(crate_m[0]), float(crate_m[1])),
    )  # fmt: skip
    world = load_world("flat").model_copy(update={"obstacle": crate})
    view = TopView(robot, world, CAMERA, (0.0, 0.0), seed)
    shown = [replace(one, picture=view.picture(one.qpos).copy()) for one in (away, scene)]
    view.close()
    return shown[0], shown[1]


def _links(scene: Scene, robot: RobotConfig) -> Floats:
    """(L, 2) centres in the world."""
    pose = pose_at(scene.head_m, scene.heading_rad)
    return np.asarray(body_in_world(robot, pose, scene.joint_rad).link_m[:, :2])


def _apart_m(links_m: Floats, at_m: Floats) -> float:
    return float(np.hypot(*(links_m - at_m).T).min())


def _told(name: str, found: Found) -> list[Row]:
    return [
        Row(f"{name}: used, of {POSES}", found.used, "frames", "15", 15 / max(found.used, 1), 1.0),
        Row(f"{name}: used and wrong", found.wrong, "frames", "none", float(found.wrong), 0.0),
        Row(f"{name}: head, worst", 1e3 * found.head_max_m, "mm", "5 mm",
            found.head_max_m / WRONG_M, 1.0),
    ]  # fmt: skip
