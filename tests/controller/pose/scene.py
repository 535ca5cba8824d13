"""A snake that waves without physics: its joints, its true pose, and a tracker that may fail."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.pose import PoseConfig
from snakewalk.controller.pose.dead_reckoning import DeadReckoning
from snakewalk.controller.pose.external_pose import ExternalPose
from snakewalk.controller.pose.sample import ArrivedPose, PoseSample
from snakewalk.controller.pose.tracked_body import TrackedBody
from snakewalk.drivers.types import BodyPose, JointState

ROBOT = load_robot("yaw16")
FRICTION = load_world("flat").friction
CYCLE_S = 0.02
CLOCK_S = 1234.5
Change = Callable[[float, PoseSample], Sequence[ArrivedPose | PoseSample]]


def joint_state(time_s: float) -> JointState:
    """Return the state of joints in a serpenoid wave."""
    joints = ROBOT.joint_count
    phase = 2.0 * np.pi * (0.4 * time_s - 1.2 * np.arange(joints) / joints)
    none, no = np.zeros(joints), np.zeros(joints, np.uint8)
    return JointState(
        time_s, 0.5 * np.sin(phase), none, none, none, none, no, no, none, no == 0, none
    )


def reckoning() -> DeadReckoning:
    return DeadReckoning(ROBOT, FRICTION, (0.0, 0.0), 0.3)


@dataclass
class Scene:
    """A client with an external pose, and the truth."""

    config: PoseConfig = field(default_factory=lambda: PoseConfig(latency_s=0.06))
    delay_s: float = 0.06
    noise_m: float = 0.0
    begins_s: float = 0.0
    """When the joints begin to move."""
    pace: float = 1.0
    """Rate of the joints over that of the wave."""
    rest_s: float = np.inf
    """When the joints come to rest."""
    events: list[str] = field(default_factory=list)
    errors_m: list[float] = field(default_factory=list)
    headings_rad: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._waiting: list[ArrivedPose] = []
        self._true = reckoning()
        self._body = TrackedBody(ROBOT, self.config)
        self._rng = np.random.default_rng(5)
        self.cycles = 0
        self.pose = ExternalPose(ROBOT, self.config, self, reckoning(), self.events.append)

    def arrived(self, now_s: float) -> list[ArrivedPose]:
        due = [each for each in self._waiting if each.arrival_s <= now_s]
        self._waiting = [each for each in self._waiting if each.arrival_s > now_s]
        return due

    def run(self, seconds: float, change: Change = lambda time_s, sample: [sample]) -> None:
        """Let time pass; ``change`` makes messages of the true sample."""
        for _ in range(round(seconds / CYCLE_S)):
            time_s = self.cycles * CYCLE_S
            moving_s = self.pace * max(min(time_s, self.rest_s) - self.begins_s, 0.0)
            state = joint_state(moving_s)._replace(time_s=time_s)
            head = self._true(state)
            true = BodyPose(time_s, np.append(head.head_in_world_m[:2], 0.03), head.rotation)
            position_m, axes = self._body.body(true, state.position_rad)
            noise = self.noise_m * self._rng.standard_normal(3)
            sample = PoseSample(self.cycles, time_s + CLOCK_S, position_m + noise, axes, "lab")
            for sent in change(time_s, sample):
                due_s = time_s + self.delay_s
                self._waiting.append(
                    ArrivedPose(due_s, "10.0.0.1:5000", sent)
                    if isinstance(sent, PoseSample)
                    else sent
                )
            found = self.pose(state)
            self.errors_m.append(
                float(np.hypot(*(found.head_in_world_m - true.head_in_world_m)[:2]))
            )
            turn = found.heading_rad - true.heading_rad
            self.headings_rad.append(float(abs(np.arctan2(np.sin(turn), np.cos(turn)))))
            self.cycles += 1


def moved(sample: PoseSample, by_m: Floats | Sequence[float]) -> PoseSample:
    return replace(sample, position_m=sample.position_m + np.asarray(by_m))
