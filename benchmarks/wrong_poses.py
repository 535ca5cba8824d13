"""``python -m benchmarks.wrong_poses [KIND ...]``: rehearsals with poses that are wrong.

A served robot is rehearsed with a tracker of 1 cm, 3 degrees and 100 ms of error, whose poses are
changed as KIND says before they arrive. A claim is false if the true body did not come to a claimed
waypoint within its radius and twice the accuracy that the run states. ``good`` changes nothing.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final
from unittest.mock import patch

import numpy as np
from rich.console import Console
from rich.table import Table

from snakewalk.config.arrays import Floats
from snakewalk.config.pose import TrackerConfig
from snakewalk.controller.pose.sample import ArrivedPose, PoseSample, quaternion_of, rotation_of
from snakewalk.controller.pose.udp_feed import SimulatedDatagrams
from snakewalk.controller.rehearsal import rehearsal
from snakewalk.drivers.attitude import rotation_by

TRACKER: Final = TrackerConfig(noise_m=0.01, noise_deg=3.0, delay_s=0.1)
FALL_S: Final = 12.0
STEP_S: Final = 10.0
"""When a marker falls off, and when a source steps."""
UP: Final = np.array([0.0, 0.0, 1.0])
Change = Callable[[PoseSample, PoseSample, float], PoseSample]
"""Makes the sent sample of the true one, the first one, and the time since the first."""


def turned(angle_deg: float) -> Change:
    """A frame that is turned about the start."""
    turn = rotation_by(np.radians(angle_deg) * UP)

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        place_m = first.position_m + turn @ (sample.position_m - first.position_m)
        return replace(sample, position_m=place_m, rotation=turn @ sample.rotation)

    return change


def scaled(scale: float) -> Change:
    """Positions about the start times a number."""

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        place_m = first.position_m + scale * (sample.position_m - first.position_m)
        return replace(sample, position_m=place_m)

    return change


def moved(offset_m: Callable[[float], list[float]]) -> Change:
    """Positions with an offset (3,) that depends on the time."""

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        return replace(sample, position_m=sample.position_m + offset_m(time_s))

    return change


def twisted(angle_deg: float) -> Change:
    """Axes of the tracked body that are turned against its link."""
    turn = rotation_by(np.radians(angle_deg) * UP)
    return lambda sample, first, time_s: replace(sample, rotation=sample.rotation @ turn)


def mirrored(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
    """A left-handed frame about the start."""
    mirror = np.diag([1.0, -1.0, 1.0])
    place_m = first.position_m + mirror @ (sample.position_m - first.position_m)
    return replace(sample, position_m=place_m, rotation=mirror @ sample.rotation @ mirror)


def exchanged(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
    """X and y exchanged in places and attitudes."""
    swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    rotation = swap @ sample.rotation @ swap
    return replace(sample, position_m=swap @ sample.position_m, rotation=rotation)


def identity(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
    """The attitude of the first pose in all poses."""
    return replace(sample, rotation=first.rotation)


def rotated(about: list[float], angle_deg: float, *, places: bool = True) -> Change:
    """A frame that is turned about an axis; ``places`` False: of the attitudes only."""
    turn = rotation_by(np.radians(angle_deg) * np.array(about))

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        place_m = turn @ sample.position_m if places else sample.position_m
        return replace(sample, position_m=place_m, rotation=turn @ sample.rotation)

    return change


def of_quaternion(order: Callable[[list[float]], list[float]]) -> Change:
    """Attitudes whose quaternion (w, x, y, z) is changed."""

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        wxyz = order(list(quaternion_of(sample.rotation)))
        return replace(sample, rotation=rotation_of(wxyz))

    return change


def flipping(axis: list[float], angle_deg: float, share: float) -> Change:
    """A share of the attitudes is turned about an axis of the body, in runs of 0.2 s."""
    turn = rotation_by(np.radians(angle_deg) * np.array(axis))

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        if np.random.default_rng(int(5.0 * time_s)).random() > share:
            return sample
        return replace(sample, rotation=sample.rotation @ turn)

    return change


def stamped(stamp_s: Callable[[float, float], float]) -> Change:
    """Other stamps, of the true one and the time since the first."""
    return lambda sample, first, time_s: replace(sample, time_s=stamp_s(sample.time_s, time_s))


@dataclass
class FrozenAfter:
    """The same pose again and again from a time on."""

    after_s: float
    kept: PoseSample | None = None

    def __call__(self, sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        """Return the pose that is sent."""
        if time_s < self.after_s:
            return sample
        self.kept = self.kept or sample
        return replace(self.kept, sequence=sample.sequence, time_s=sample.time_s)


@dataclass
class StillAfter:
    """A body that lies still from a time on, with 2 mm and 0.6 degrees of noise."""

    after_s: float
    kept: PoseSample | None = None
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(5))

    def __call__(self, sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        """Return the pose that is sent."""
        if time_s < self.after_s:
            return sample
        self.kept = self.kept or sample
        place_m: Floats = self.kept.position_m + 0.002 * self.rng.standard_normal(3)
        turn = rotation_by(0.01 * self.rng.standard_normal(3))
        return replace(sample, position_m=place_m, rotation=turn @ self.kept.rotation)


KINDS: Final[dict[str, Callable[[], Change]]] = {
    "good": lambda: lambda sample, first, time_s: sample,
    **{f"turned by {a}": lambda a=a: turned(a) for a in (10.0, 30.0, 90.0, 180.0)},  # type: ignore[misc]
    **{f"times {k}": lambda k=k: scaled(k) for k in (0.5, 0.9, 1.1, 2.0, 1000.0)},  # type: ignore[misc]
    "0.4 m to the side": lambda: moved(lambda time_s: [0.0, 0.4, 0.0]),
    "0.4 m ahead": lambda: moved(lambda time_s: [0.4, 0.0, 0.0]),
    "drift of 2 cm/s": lambda: moved(lambda time_s: [0.012 * time_s, 0.016 * time_s, 0.0]),
    "drift of 3 cm/s": lambda: moved(lambda time_s: [0.0, 0.03 * time_s, 0.0]),
    "drift of 2 cm/s after 10 s": lambda: moved(
        lambda time_s: [0.0, 0.02 * max(time_s - STEP_S, 0.0), 0.0]
    ),
    "a step of 0.2 m": lambda: moved(lambda time_s: [0.0, 0.2 * (time_s > STEP_S), 0.0]),
    "a step of 0.5 m": lambda: moved(lambda time_s: [0.5 * (time_s > STEP_S), 0.0, 0.0]),
    "axes turned by 45": lambda: twisted(45.0),
    "axes turned by 90": lambda: twisted(90.0),
    "left-handed": lambda: mirrored,
    "one attitude": lambda: identity,
    "another body": lambda: StillAfter(0.0),
    "a marker falls off": lambda: StillAfter(FALL_S),
    "y axis up": lambda: rotated([1.0, 0.0, 0.0], -90.0),
    "y axis up, of attitudes only": lambda: rotated([1.0, 0.0, 0.0], -90.0, places=False),
    "x and y exchanged": lambda: exchanged,
    "quaternion x, y, z, w": lambda: of_quaternion(lambda q: [q[1], q[2], q[3], q[0]]),
    "inverse quaternion": lambda: of_quaternion(lambda q: [q[0], -q[1], -q[2], -q[3]]),
    "y of the quaternion inverted": lambda: of_quaternion(lambda q: [q[0], q[1], -q[2], q[3]]),
    "tag flips, 1 of 5": lambda: flipping([1.0, 0.0, 0.0], 40.0, 0.2),
    "tag flips by 180, 1 of 20": lambda: flipping([1.0, 0.0, 0.0], 180.0, 0.05),
    "times 0.6": lambda: scaled(0.6),
    "times 1.6": lambda: scaled(1.6),
    "scale grows by 1 % a second": lambda: (
        lambda sample, first, time_s: scaled(1.0 + 0.01 * time_s)(sample, first, time_s)
    ),
    "1 cm to the side": lambda: moved(lambda time_s: [0.0, 0.01, 0.0]),
    "0.2 m to the side": lambda: moved(lambda time_s: [0.0, 0.2, 0.0]),
    "17 m too high": lambda: moved(lambda time_s: [0.0, 0.0, 17.0]),
    "3 cm off by place": lambda: (
        lambda sample, first, time_s: replace(
            sample, position_m=sample.position_m + 0.03 * np.sin(4.0 * sample.position_m[::-1])
        )
    ),
    "frozen after 12 s": lambda: FrozenAfter(FALL_S),
    "huge numbers after 12 s": lambda: moved(lambda time_s: [4e27 * (time_s > FALL_S), 0.0, 0.0]),
    "stamps in milliseconds": lambda: stamped(lambda stamp_s, time_s: 1000.0 * stamp_s),
    "one stamp": lambda: stamped(lambda stamp_s, time_s: stamp_s - time_s),
    "stamps 1 % fast": lambda: stamped(lambda stamp_s, time_s: stamp_s + 0.01 * time_s),
}
_GITHUB = "https://github.com/"
REPORTS: Final[dict[str, str]] = {
    "turned by 90.0": f"{_GITHUB}USC-ACTLab/crazyswarm/issues/21",
    "times 0.6": f"{_GITHUB}rpng/open_vins/issues/113",
    "times 1.6": f"{_GITHUB}rpng/open_vins/issues/113",
    "times 1.1": f"{_GITHUB}ethz-asl/rovio/issues/194",
    "times 1000.0": f"{_GITHUB}MOCAP4ROS2-Project/mocap4ros2_vicon/pull/17",
    "scale grows by 1 % a second": f"{_GITHUB}raulmur/ORB_SLAM2/issues/71",
    "drift of 2 cm/s": f"{_GITHUB}pushrax/OpenVR-SpaceCalibrator/issues/41",
    "drift of 2 cm/s after 10 s": f"{_GITHUB}collabora/libsurvive/issues/362",
    "a step of 0.2 m": f"{_GITHUB}ValveSoftware/steamvr_unity_plugin/issues/1013",
    "1 cm to the side": f"{_GITHUB}ValveSoftware/SteamVR-for-Linux/issues/167",
    "17 m too high": f"{_GITHUB}asymingt/libsurvive_ros2/issues/20",
    "left-handed": f"{_GITHUB}crigroup/optitrack/issues/1",
    "y axis up": f"{_GITHUB}ros-drivers/mocap_optitrack/pull/56",
    "y axis up, of attitudes only": f"{_GITHUB}tud-phi/ros2-mocap_optitrack/issues/9",
    "x and y exchanged": f"{_GITHUB}MOCAP4ROS2-Project/mocap4ros2_optitrack/issues/39",
    "quaternion x, y, z, w": f"{_GITHUB}DFKI-NI/mobipick/issues/4",
    "inverse quaternion": f"{_GITHUB}ethz-asl/ethzasl_msf/issues/132",
    "y of the quaternion inverted": f"{_GITHUB}ros-drivers/mocap_optitrack/issues/33",
    "tag flips, 1 of 5": f"{_GITHUB}AprilRobotics/apriltag/issues/71",
    "tag flips by 180, 1 of 20": f"{_GITHUB}UbiquityRobotics/fiducials/issues/223",
    "3 cm off by place": f"{_GITHUB}AprilRobotics/apriltag_ros/issues/160",
    "frozen after 12 s": f"{_GITHUB}styly-dev/STYLY-NetSync/pull/474",
    "huge numbers after 12 s": f"{_GITHUB}NVIDIA-ISAAC-ROS/isaac_ros_visual_slam/issues/9",
    "stamps in milliseconds": f"{_GITHUB}USC-ACTLab/libmotioncapture/pull/4",
    "one stamp": f"{_GITHUB}ros-drivers/mocap_optitrack/issues/22",
    "stamps 1 % fast": f"{_GITHUB}KTH-SML/motion_capture_system/issues/3",
}
"""Public reports of such errors."""


class WrongSource:
    """Changes the poses of a simulated tracker."""

    def __init__(self, change: Change) -> None:
        self._change = change
        self._first: PoseSample | None = None

    def __call__(self, arrived: ArrivedPose) -> ArrivedPose:
        """Return a message with another pose."""
        sample = arrived.sample
        if not isinstance(sample, PoseSample):
            return arrived
        self._first = self._first or sample
        time_s = sample.time_s - self._first.time_s
        return replace(arrived, sample=self._change(sample, self._first, time_s))


def rehearsed(kind: str, run: str, seed: int, has_errors: bool) -> dict[str, Any]:
    """Rehearse a run with a kind of wrong poses."""
    source = WrongSource(KINDS[kind]())
    true = SimulatedDatagrams.arrived

    def arrived(self: SimulatedDatagrams, now_s: float) -> Sequence[ArrivedPose]:
        return [source(each) for each in true(self, now_s)]

    with patch.object(SimulatedDatagrams, "arrived", arrived):
        return rehearsal.rehearse(rehearsal.RehearsalCase(run, seed, has_errors, TRACKER))


def main() -> int:
    """Rehearse and print a table; 1 if a claim is false."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.wrong_poses", description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--run", default="flat-slalom")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--errors", action="store_true", help="robot and ground have errors, too")
    given = parser.parse_args()
    shown = Table("pose", "seed", "claimed", "as stated", "true", "end", title=given.run)
    false = 0
    for kind in given.kinds or KINDS:
        for seed in range(given.seeds):
            row = rehearsed(kind, given.run, seed, given.errors)
            counts = [row.get(key, 0) for key in ("claimed", "reached_as_stated", "truly_reached")]
            false += counts[0] > counts[1]
            end = row.get("error") or row["verdict"]
            shown.add_row(kind, str(seed), *map(str, counts), end)
    Console(width=160).print(shown)
    print(f"false claims: {false}")
    return int(false > 0)


if __name__ == "__main__":
    raise SystemExit(main())
