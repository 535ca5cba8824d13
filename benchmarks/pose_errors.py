"""Kinds of wrong poses, each with a public report or manual that describes such an error."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.controller.pose.sample import (
    PoseSample,
    UnusablePoseError,
    quaternion_of,
    rotation_of,
)
from snakewalk.drivers.attitude import rotation_by

EVENT_S: Final = 12.0
"""When a marker falls off, and other errors begin."""
STEP_S: Final = 10.0
"""When a source steps, or begins to drift."""
UP: Final = np.array([0.0, 0.0, 1.0])
Answer = PoseSample | Sequence[PoseSample]
Change = Callable[[PoseSample, PoseSample, float], Answer]
"""Makes what is sent of the true sample, the first one, and the time since the first.

It raises ``UnusablePoseError`` if a datagram contains no pose.
"""


def turned(angle_deg: float, after_s: float = 0.0) -> Change:
    """A frame that is turned about the start, or later about the place of that time."""
    turn = rotation_by(np.radians(angle_deg) * UP)
    pivots: list[Floats] = []

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        if time_s < after_s:
            return sample
        pivots.append(sample.position_m)
        place_m = pivots[0] + turn @ (sample.position_m - pivots[0])
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


def placed(place_m: Callable[[Floats], Floats]) -> Change:
    """Positions that are a function of the true position."""
    return lambda sample, first, time_s: replace(sample, position_m=place_m(sample.position_m))


def twisted(
    angle_deg: float, about: Sequence[float] = (0.0, 0.0, 1.0), after_s: float = 0.0
) -> Change:
    """Axes of the tracked body that are turned against its link."""
    turn = rotation_by(np.radians(angle_deg) * np.array(about))

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        return replace(sample, rotation=sample.rotation @ turn) if time_s >= after_s else sample

    return change


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


def inverted(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
    """The pose of the frame in the body, instead of that of the body in the frame."""
    back = sample.rotation.T
    return replace(sample, position_m=-back @ sample.position_m, rotation=back)


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


def of_angles(order: Callable[[list[float]], list[float]]) -> Change:
    """Attitudes whose roll, pitch and yaw in degrees are changed."""

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        angles = Rotation.from_matrix(sample.rotation).as_euler("xyz", degrees=True)
        rotation = Rotation.from_euler("xyz", order(angles.tolist()), degrees=True)
        return replace(sample, rotation=rotation.as_matrix())

    return change


def degrees(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
    """Angles in degrees in the place of the quaternion."""
    angles = Rotation.from_matrix(sample.rotation).as_euler("xyz", degrees=True)
    return replace(sample, rotation=rotation_of([0.0, *angles.tolist()]))


def flipping(axis: list[float], angle_deg: float, share: float) -> Change:
    """A share of the attitudes is turned about an axis of the body, in runs of 0.2 s."""
    turn = rotation_by(np.radians(angle_deg) * np.array(axis))

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        if np.random.default_rng(int(5.0 * time_s)).random() > share:
            return sample
        return replace(sample, rotation=sample.rotation @ turn)

    return change


def heading_drift(rate_deg_s: float) -> Change:
    """Attitudes whose heading drifts, with right positions."""

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        turn = rotation_by(np.radians(rate_deg_s * time_s) * UP)
        return replace(sample, rotation=turn @ sample.rotation)

    return change


def by_turns(place_m: Callable[[PoseSample], Floats], share: float) -> Change:
    """A share of the positions is that of another source, in runs of 0.2 s."""

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        if np.random.default_rng(int(5.0 * time_s)).random() > share or time_s < 0.5:
            return sample
        return replace(sample, position_m=place_m(first))

    return change


def noisy(noise_m: float, noise_deg: float) -> Change:
    """More noise than the covariance states."""
    rng = np.random.default_rng(7)

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        turn = rotation_by(np.radians(noise_deg) * rng.standard_normal(3))
        place_m = sample.position_m + noise_m * rng.standard_normal(3)
        return replace(sample, position_m=place_m, rotation=turn @ sample.rotation)

    return change


def stamped(stamp_s: Callable[[float, float], float]) -> Change:
    """Other stamps, of the true one and the time since the first."""
    return lambda sample, first, time_s: replace(sample, time_s=stamp_s(sample.time_s, time_s))


def with_covariance(variance: float) -> Change:
    """The same variance in all six numbers."""
    matrix = variance * np.eye(6)
    return lambda sample, first, time_s: replace(sample, covariance=matrix)


def missing(is_missing: Callable[[float, int], bool]) -> Change:
    """Poses that are not sent, by time and sequence."""

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> Answer:
        return [] if is_missing(time_s, sample.sequence) else sample

    return change


def unusable(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
    """NaN in all poses from a time on."""
    if time_s < EVENT_S:
        return sample
    raise UnusablePoseError("position_m: not finite (NaN); the tracker has lost the body")


def zeros(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
    """Place and attitude of zero while the body is lost: one second of five."""
    if time_s % 5.0 < 4.0:
        return sample
    return replace(sample, position_m=np.zeros(3), rotation=np.eye(3))


@dataclass
class Late:
    """Old poses with new stamps."""

    delay_s: Callable[[float], float]
    kept: deque[tuple[float, PoseSample]] = field(default_factory=deque)

    def __call__(self, sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        """Return the pose that is sent."""
        self.kept.append((time_s, sample))
        if time_s < 1.0:  # before the start the source has the delay, too, and the body rests
            return sample
        due_s = time_s - self.delay_s(time_s)
        while len(self.kept) > 1 and self.kept[1][0] <= due_s:
            self.kept.popleft()
        return replace(self.kept[0][1], sequence=sample.sequence, time_s=sample.time_s)


@dataclass
class Bursts:
    """Poses that wait and arrive together."""

    every_s: float
    waiting: list[PoseSample] = field(default_factory=list)
    sent_s: float = 0.0

    def __call__(self, sample: PoseSample, first: PoseSample, time_s: float) -> Answer:
        """Return the poses that are sent."""
        self.waiting.append(sample)
        if time_s - self.sent_s < self.every_s and time_s > 0.0:
            return []
        self.sent_s = time_s
        sent, self.waiting = self.waiting, []
        return sent


@dataclass
class OutOfOrder:
    """Each third pose arrives after the next one."""

    waiting: PoseSample | None = None

    def __call__(self, sample: PoseSample, first: PoseSample, time_s: float) -> Answer:
        """Return the poses that are sent."""
        if self.waiting is not None:
            late, self.waiting = self.waiting, None
            return [sample, late]
        if sample.sequence % 3 == 1:
            self.waiting = sample
            return []
        return sample


@dataclass
class Smoothed:
    """Positions and attitudes through a low pass, and extrapolated by some time."""

    time_constant_s: float
    ahead_s: float = 0.0
    last: PoseSample | None = None
    seconds: float = 0.0

    def __call__(self, sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        """Return the pose that is sent."""
        last = self.last or sample
        step_s = sample.time_s - last.time_s
        self.seconds += step_s
        share = step_s / min(self.time_constant_s, max(self.seconds, step_s, 1e-3))
        turn = Rotation.from_matrix(sample.rotation @ last.rotation.T).as_rotvec()
        rotation = rotation_by(share * turn) @ last.rotation
        place_m = last.position_m + share * (sample.position_m - last.position_m)
        self.last = replace(sample, position_m=place_m, rotation=rotation)
        if step_s <= 0.0 or self.ahead_s == 0.0:
            return self.last
        steps = self.ahead_s / step_s
        ahead_m = place_m + steps * (place_m - last.position_m)
        return replace(
            sample,
            position_m=ahead_m,
            rotation=rotation_by(steps * share * turn) @ rotation,
        )


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


def circling(after_s: float) -> Change:
    """Another body from a time on, which circles with 0.3 m and 9 s."""

    def change(sample: PoseSample, first: PoseSample, time_s: float) -> PoseSample:
        if time_s < after_s:
            return sample
        angle = 0.7 * time_s
        place_m = first.position_m + 0.3 * np.array([np.cos(angle), np.sin(angle), 0.0])
        return replace(sample, position_m=place_m, rotation=rotation_by(angle * UP))

    return change


class Kind(NamedTuple):
    """A kind of wrong poses."""

    name: str
    change: Callable[[], Change]
    address: str
    """Public description of such an error: a thread of GitHub, or an address."""


def _float32_m(place_m: Floats) -> Floats:
    origin_m = np.array([388_096.0, 3_948_996.0, 0.0])
    rounded_m: Floats = (place_m + origin_m).astype(np.float32).astype(np.float64) - origin_m
    return rounded_m


GOOD: Final = "good"
_OPTITRACK = "https://docs.optitrack.com/motive"
KINDS: Final = (
    Kind("turned by 10", lambda: turned(10.0), "SteveMacenski/slam_toolbox/issues/167"),
    Kind("turned by 30", lambda: turned(30.0), "OSVR/OSVR-Core/issues/530"),
    Kind("turned by 90", lambda: turned(90.0), "USC-ACTLab/crazyswarm/issues/21"),
    Kind("turned by 180", lambda: turned(180.0), "mavlink/mavros/issues/523"),
    Kind("turned by 15 after 10 s", lambda: turned(15.0, STEP_S), f"{_OPTITRACK}/calibration"),
    Kind("times 0.5", lambda: scaled(0.5), "rpng/open_vins/issues/113"),
    Kind("times 0.6", lambda: scaled(0.6), "rpng/open_vins/issues/113"),
    Kind(
        "times 0.9",
        lambda: scaled(0.9),
        "https://v21.wiki.optitrack.com/index.php?title=Calibration_pane",
    ),
    Kind("times 1.1", lambda: scaled(1.1), "ethz-asl/rovio/issues/194"),
    Kind("times 1.6", lambda: scaled(1.6), "AprilRobotics/apriltag_ros/issues/84"),
    Kind("times 2", lambda: scaled(2.0), "AprilRobotics/apriltag_ros/issues/84"),
    Kind("times 100", lambda: scaled(100.0), "microsoft/AirSim/issues/2401"),
    Kind("times 1000", lambda: scaled(1000.0), "MOCAP4ROS2-Project/mocap4ros2_vicon/pull/17"),
    Kind(
        "scale grows by 1 % a second",
        lambda: lambda sample, first, time_s: scaled(1.0 + 0.01 * time_s)(sample, first, time_s),
        "raulmur/ORB_SLAM2/issues/71",
    ),
    Kind(
        "1 cm to the side",
        lambda: moved(lambda time_s: [0.0, 0.01, 0.0]),
        "ValveSoftware/SteamVR-for-Linux/issues/167",
    ),
    Kind(
        "0.2 m to the side",
        lambda: moved(lambda time_s: [0.0, 0.2, 0.0]),
        "opentrack/opentrack/issues/233",
    ),
    Kind(
        "0.4 m to the side",
        lambda: moved(lambda time_s: [0.0, 0.4, 0.0]),
        "opentrack/opentrack/issues/801",
    ),
    Kind(
        "0.4 m ahead",
        lambda: moved(lambda time_s: [0.4, 0.0, 0.0]),
        "opentrack/opentrack/issues/801",
    ),
    Kind(
        "1.1 m too high",
        lambda: moved(lambda time_s: [0.0, 0.0, 1.1]),
        "rsasaki0109/lidar_localization_ros2/issues/44",
    ),
    Kind(
        "17 m too high",
        lambda: moved(lambda time_s: [0.0, 0.0, 17.0]),
        "asymingt/libsurvive_ros2/issues/20",
    ),
    Kind(
        "height always 0",
        lambda: placed(lambda place_m: place_m * [1.0, 1.0, 0.0]),
        "autowarefoundation/autoware/issues/986",
    ),
    Kind(
        "drift of 2 cm/s",
        lambda: moved(lambda time_s: [0.012 * time_s, 0.016 * time_s, 0.0]),
        "pushrax/OpenVR-SpaceCalibrator/issues/41",
    ),
    Kind(
        "drift of 3 cm/s",
        lambda: moved(lambda time_s: [0.0, 0.03 * time_s, 0.0]),
        "ethz-asl/rovio/issues/70",
    ),
    Kind(
        "drift of 2 cm/s after 10 s",
        lambda: moved(lambda time_s: [0.0, 0.02 * max(time_s - STEP_S, 0.0), 0.0]),
        "collabora/libsurvive/issues/362",
    ),
    Kind(
        "a step of 0.2 m",
        lambda: moved(lambda time_s: [0.0, 0.2 * (time_s > STEP_S), 0.0]),
        "ValveSoftware/steamvr_unity_plugin/issues/1013",
    ),
    Kind(
        "a step of 0.5 m",
        lambda: moved(lambda time_s: [0.5 * (time_s > STEP_S), 0.0, 0.0]),
        "sauravag/slam_karto_gtsam/issues/2",
    ),
    Kind(
        "steps of 6 cm each 5 s",
        lambda: moved(lambda time_s: [0.0, 0.06 * (int(time_s / 5.0) % 2), 0.0]),
        "SteveMacenski/slam_toolbox/issues/664",
    ),
    Kind("axes turned by 45", lambda: twisted(45.0), "mavlink/mavros/issues/390"),
    Kind("axes turned by 90", lambda: twisted(90.0), "mavlink/mavros/issues/1067"),
    Kind(
        "axes turned by 25 after 12 s",
        lambda: twisted(25.0, after_s=EVENT_S),
        f"{_OPTITRACK}/rigid-body-tracking",
    ),
    Kind(
        "axes turned by 180 after 12 s",
        lambda: twisted(180.0, after_s=EVENT_S),
        "opentrack/opentrack/issues/378",
    ),
    Kind(
        "body forward, right, down",
        lambda: twisted(180.0, (1.0, 0.0, 0.0)),
        "mavlink/mavros/pull/889",
    ),
    Kind(
        "15 cm ahead of its link",
        lambda: (
            lambda sample, first, time_s: replace(
                sample, position_m=sample.position_m + sample.rotation @ [0.15, 0.0, 0.0]
            )
        ),
        "Agroecology-Lab/feldfreund_devkit_ros/issues/49",
    ),
    Kind("left-handed", lambda: mirrored, "crigroup/optitrack/issues/1"),
    Kind(
        "y axis up", lambda: rotated([1.0, 0.0, 0.0], -90.0), "ros-drivers/mocap_optitrack/pull/56"
    ),
    Kind(
        "y axis up, of attitudes only",
        lambda: rotated([1.0, 0.0, 0.0], -90.0, places=False),
        "tud-phi/ros2-mocap_optitrack/issues/9",
    ),
    Kind("z axis down", lambda: rotated([1.0, 0.0, 0.0], 180.0), "mavlink/mavros/issues/225"),
    Kind(
        "ground tilted by 5 degrees",
        lambda: rotated([0.0, 1.0, 0.0], 5.0),
        "koide3/hdl_localization/issues/73",
    ),
    Kind(
        "x and y exchanged", lambda: exchanged, "MOCAP4ROS2-Project/mocap4ros2_optitrack/issues/39"
    ),
    Kind("camera in the tag's frame", lambda: inverted, "AprilRobotics/apriltag/issues/193"),
    Kind("one attitude", lambda: identity, "ethz-asl/rovio/issues/70"),
    Kind(
        "quaternion x, y, z, w",
        lambda: of_quaternion(lambda q: [q[1], q[2], q[3], q[0]]),
        "DFKI-NI/mobipick/issues/4",
    ),
    Kind(
        "inverse quaternion",
        lambda: of_quaternion(lambda q: [q[0], -q[1], -q[2], -q[3]]),
        "ethz-asl/ethzasl_msf/issues/132",
    ),
    Kind(
        "y of the quaternion inverted",
        lambda: of_quaternion(lambda q: [q[0], q[1], -q[2], q[3]]),
        "ros-drivers/mocap_optitrack/issues/33",
    ),
    Kind(
        "roll and pitch exchanged",
        lambda: of_angles(lambda a: [a[1], a[0], a[2]]),
        "PX4/PX4-SITL_gazebo-classic/issues/193",
    ),
    Kind(
        "yaw, pitch, roll in the wrong order",
        lambda: of_angles(lambda a: [a[2], -a[1], a[0]]),
        "robotology/icub-main/issues/701",
    ),
    Kind("angles in degrees", lambda: degrees, "ethz-asl/vicon_bridge/issues/15"),
    Kind(
        "heading drifts by 1 degree a second",
        lambda: heading_drift(1.0),
        "opentrack/opentrack/issues/766",
    ),
    Kind(
        "tag flips, 1 of 5",
        lambda: flipping([1.0, 0.0, 0.0], 40.0, 0.2),
        "AprilRobotics/apriltag/issues/71",
    ),
    Kind(
        "tag flips by 180, 1 of 20",
        lambda: flipping([1.0, 0.0, 0.0], 180.0, 0.05),
        "UbiquityRobotics/fiducials/issues/223",
    ),
    Kind(
        "5 cm and 10 degrees of noise",
        lambda: noisy(0.05, 10.0),
        "pal-robotics/aruco_ros/issues/147",
    ),
    Kind(
        "3 cm off by place",
        lambda: placed(lambda place_m: place_m + 0.03 * np.sin(4.0 * place_m[::-1])),
        "AprilRobotics/apriltag_ros/issues/160",
    ),
    Kind(
        "32-bit numbers far from 0",
        lambda: placed(_float32_m),
        "autowarefoundation/autoware_universe/issues/3090",
    ),
    Kind("another body lies still", lambda: StillAfter(0.0), "paparazzi/paparazzi/issues/2023"),
    Kind("another body circles", lambda: circling(0.0), "paparazzi/paparazzi/issues/2023"),
    Kind(
        "another body circles after 12 s",
        lambda: circling(EVENT_S),
        "USC-ACTLab/crazyswarm/issues/32",
    ),
    Kind("a marker falls off", lambda: StillAfter(EVENT_S), "USC-ACTLab/crazyswarm/issues/50"),
    Kind(
        "another source by turns, 2 of 5",
        lambda: by_turns(lambda first: first.position_m + np.array([0.3, 0.2, 0.0]), 0.4),
        "dorezyuk/i_see_pee/issues/13",
    ),
    Kind(
        "the origin by turns, 1 of 2",
        lambda: by_turns(lambda first: np.zeros(3), 0.5),
        "PalouseRobosub/robosub-2018/issues/324",
    ),
    Kind("zeros while it is lost", lambda: zeros, "TriadSemi/triad_openvr/issues/16"),
    Kind("NaN after 12 s", lambda: unusable, "ju1ce/April-Tag-VR-FullBody-Tracker/issues/30"),
    Kind("frozen after 12 s", lambda: FrozenAfter(EVENT_S), "styly-dev/STYLY-NetSync/pull/474"),
    Kind(
        "huge numbers after 12 s",
        lambda: moved(lambda time_s: [4e27 * (time_s > EVENT_S), 0.0, 0.0]),
        "NVIDIA-ISAAC-ROS/isaac_ros_visual_slam/issues/9",
    ),
    Kind(
        "one of 8 is lost",
        lambda: missing(lambda time_s, sequence: sequence % 8 == 7),
        "USC-ACTLab/libmotioncapture/pull/3",
    ),
    Kind(
        "lost for 1 s of 5",
        lambda: missing(lambda time_s, sequence: time_s % 5.0 > 4.0),
        "IMRCLab/motion_capture_tracking/issues/6",
    ),
    Kind(
        "5 poses a second",
        lambda: missing(lambda time_s, sequence: sequence % 10 != 0),
        "microsoft/Azure-Kinect-Sensor-SDK/issues/816",
    ),
    Kind(
        "late by 0.7 s", lambda: Late(lambda time_s: 0.7), "ros-drivers/mocap_optitrack/issues/13"
    ),
    Kind(
        "late by 3.5 s", lambda: Late(lambda time_s: 3.5), "ros-drivers/mocap_optitrack/issues/25"
    ),
    Kind("ever later", lambda: Late(lambda time_s: time_s / 3.0), "Livox-SDK/LIO-Livox/issues/77"),
    Kind("bursts each 0.3 s", lambda: Bursts(0.3), "YanjieZe/GMR/issues/81"),
    Kind(
        "each pose twice",
        lambda: lambda sample, first, time_s: [sample, sample],
        "ros-drivers/mocap_optitrack/issues/76",
    ),
    Kind("out of order", OutOfOrder, "ros-drivers/phidgets_drivers/issues/17"),
    Kind("smoothed over 0.5 s", lambda: Smoothed(0.5), "KTH-SML/motion_capture_system/issues/3"),
    Kind("extrapolated by 0.3 s", lambda: Smoothed(0.1, 0.3), "sergeivolodin/testAPI/issues/31"),
    Kind(
        "stamps in milliseconds",
        lambda: stamped(lambda stamp_s, time_s: 1000.0 * stamp_s),
        "USC-ACTLab/libmotioncapture/pull/4",
    ),
    Kind(
        "one stamp",
        lambda: stamped(lambda stamp_s, time_s: stamp_s - time_s),
        "ros-drivers/mocap_optitrack/issues/22",
    ),
    Kind(
        "stamps 1 % fast",
        lambda: stamped(lambda stamp_s, time_s: stamp_s + 0.01 * time_s),
        "KTH-SML/motion_capture_system/issues/3",
    ),
    Kind(
        "clock set back by 10 s",
        lambda: stamped(lambda stamp_s, time_s: stamp_s - 10.0 * (time_s > STEP_S)),
        "introlab/rtabmap_ros/pull/1333",
    ),
    Kind("covariance 0", lambda: with_covariance(0.0), "cra-ros-pkg/robot_localization/issues/246"),
    Kind("covariance 1e5", lambda: with_covariance(1e5), "ethz-asl/rovio/issues/70"),
    Kind(
        "another frame after 12 s",
        lambda: (
            lambda sample, first, time_s: replace(
                sample, frame="map" if time_s > EVENT_S else sample.frame
            )
        ),
        "facebookresearch/pyrobot/issues/69",
    ),
)
"""All kinds."""


def source_of(kind: Kind) -> str:
    """Return the whole address of a kind's source."""
    return kind.address if "://" in kind.address else f"https://github.com/{kind.address}"


def changes() -> dict[str, Callable[[], Change]]:
    """Return the kinds by name, with poses that are not changed."""
    same: Callable[[], Change] = lambda: lambda sample, first, time_s: sample  # noqa: E731
    return {GOOD: same} | {kind.name: kind.change for kind in KINDS}
