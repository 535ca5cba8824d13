"""A robot with tags on its links, and a camera that looks at it aslant."""

from dataclasses import dataclass, field

import numpy as np

from snakewalk.config.camera import CameraConfig
from snakewalk.config.loader import load_robot
from snakewalk.config.robot import RobotConfig
from snakewalk.config.tags import TagMount, TagsConfig
from snakewalk.controller.cameras.tags.tag_camera import DrawnTags
from snakewalk.controller.cameras.tags.tag_detector import TagDetector
from snakewalk.controller.cameras.tags.tag_fit import HeadFit, TagFit
from snakewalk.controller.cameras.tags.tag_view import TagView
from snakewalk.controller.pose.sample import turned
from snakewalk.drivers.types import BodyPose

ASLANT = CameraConfig(
    width_px=1000,
    height_px=750,
    field_width_m=1.6,
    height_m=1.6,
    place_m=(-0.4, -1.4, 1.5),
    aim_m=(-0.4, 0.0, 0.0),
)


def tagged(links: tuple[int, ...] = (0, 3, 6, 9, 12, 15), side_m: float = 0.06) -> RobotConfig:
    """Return the alternating robot with a tag on top of some links."""
    on = tuple(TagMount(id=7 + link, link=link, offset_m=(0.0, 0.0, 0.034)) for link in links)
    tags = TagsConfig(dictionary="4X4_50", side_m=side_m, on=on)
    return load_robot("alternating16").model_copy(update={"tags": tags})


def on_slope(roll_deg: float = 0.0, pitch_deg: float = 0.0, yaw_deg: float = 0.0) -> BodyPose:
    return BodyPose(0.0, np.array([0.1, 0.05, 0.06]), turned((roll_deg, pitch_deg, yaw_deg)))


def joints(robot: RobotConfig, seed: int = 0, most_rad: float = 0.4) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-most_rad, most_rad, robot.joint_count)


@dataclass
class Scene:
    robot: RobotConfig = field(default_factory=tagged)
    camera: CameraConfig = ASLANT
    seed: int = 0

    def __post_init__(self) -> None:
        self.view = TagView.of(self.camera)
        self.drawn = DrawnTags(self.robot, self.view, seed=self.seed)
        assert self.robot.tags is not None
        numbers = [tag.id for tag in self.robot.tags.on]
        self.detector = TagDetector(self.robot.tags.dictionary, numbers)
        self.fit = TagFit(self.robot, self.view)

    def seen(self, head: BodyPose, joint_rad: np.ndarray) -> dict[int, np.ndarray]:
        return self.detector.find(self.drawn.picture(head, joint_rad))

    def found(self, head: BodyPose, joint_rad: np.ndarray) -> HeadFit | None:
        return self.fit.fit(self.seen(head, joint_rad), joint_rad)


def error(fit: HeadFit, head: BodyPose) -> tuple[float, float]:
    """Distance (m) and angle (rad) between a fit and the truth."""
    away = float(np.linalg.norm(fit.position_m - head.head_in_world_m))
    cosine = 0.5 * (float(np.trace(fit.rotation.T @ head.rotation)) - 1.0)
    return away, float(np.arccos(np.clip(cosine, -1.0, 1.0)))
