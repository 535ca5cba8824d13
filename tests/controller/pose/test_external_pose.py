"""An external pose: bridged, corrected, dated, and every fault of a source is named."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.pose import PoseConfig
from snakewalk.controller.kinematics.links import mean_heading_rad
from snakewalk.controller.pose.datagram import decode_pose, encode_pose
from snakewalk.controller.pose.sample import (
    ArrivedPose,
    PoseSample,
    UnusablePoseError,
    turned,
)
from snakewalk.drivers.attitude import rotation_by
from tests.controller.pose.scene import CYCLE_S, ROBOT, Change, Scene, joint_state, moved

MIRROR = np.diag([1.0, -1.0, 1.0])


def bad(sample: PoseSample, **keys: object) -> list[ArrivedPose]:
    """Return the datagram of a sample with other keys, as it arrives."""
    data = json.dumps(json.loads(encode_pose(sample)) | keys).encode()
    try:
        return [ArrivedPose(sample.time_s - 1234.5 + 0.06, "10.0.0.1:5000", decode_pose(data))]
    except UnusablePoseError as fault:
        return [ArrivedPose(sample.time_s - 1234.5 + 0.06, "10.0.0.1:5000", fault)]


def test_a_late_and_noisy_pose_is_carried_on_by_the_joints() -> None:
    scene = Scene(PoseConfig(), delay_s=0.12, noise_m=0.01)
    scene.run(6.0)
    assert scene.pose.fault() is None
    assert scene.pose.facts()["pose_latency_s"] == pytest.approx(0.12, abs=0.02)
    late = slice(-100, None)
    assert np.sqrt(np.mean(np.square(scene.errors_m[late]))) < 0.010
    assert max(scene.headings_rad[late]) < 0.05
    assert scene.events == []


def test_without_compensation_the_same_pose_is_further_off() -> None:
    scene = Scene(PoseConfig(latency_s=0.0), delay_s=0.12, noise_m=0.01)
    scene.run(3.0)
    assert np.mean(scene.headings_rad[-100:]) > 0.05


def test_dead_reckoning_bridges_a_gap_and_uncertainty_grows() -> None:
    scene = Scene()
    scene.run(3.0)
    before = scene.pose.row()
    scene.run(0.4, lambda time_s, sample: [])
    after = scene.pose.row()
    assert scene.pose.fault() is None
    assert after["position_sd_m"] > 1.2 * before["position_sd_m"]
    assert after["age_s"] > 0.3
    assert scene.errors_m[-1] < 0.01


FAULTS: dict[str, tuple[Change, str]] = {
    "nothing comes": (lambda t, s: [], "no usable pose for .*: nothing arrived"),
    "late": (
        lambda t, s: [ArrivedPose(t + 2.0, "10.0.0.1:5000", s)],
        "stale: poses arrive 1.9|no usable pose .*: nothing arrived",
    ),
    "jump": (lambda t, s: [moved(s, [0.5, 0.0, 0.0])], r"jump by 0\.5\d m"),
    "NaN": (lambda t, s: bad(s, position_m=[float("nan"), 0, 0]), "not finite"),
    "degrees": (lambda t, s: bad(s, quaternion_wxyz=[90, 0, 0, 0]), "no angles in degrees"),
    "version": (lambda t, s: bad(s, snakewalk_pose=2), "version 2; this program reads version 1"),
    "frame": (lambda t, s: [replace(s, frame="optitrack")], "wrong frame: 'optitrack'"),
}


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("kind", FAULTS)
def test_a_source_that_fails_is_named(kind: str) -> None:
    change, said = FAULTS[kind]
    scene = Scene()
    scene.run(2.0)
    scene.run(1.5, change)
    fault = scene.pose.fault()
    assert fault is not None
    assert re.search(said, fault), fault
    assert max(scene.errors_m[-50:]) < 0.02, "dead reckoning goes on"
    scene.run(1.5)
    assert scene.pose.fault() is None, "and the pose is used again"


def same_pose(held: list[PoseSample]) -> Change:
    def change(time_s: float, sample: PoseSample) -> list[PoseSample]:
        held.append(sample)
        return [replace(sample, position_m=held[0].position_m, rotation=held[0].rotation)]

    return change


def test_a_pose_that_never_changes_is_stale() -> None:
    scene = Scene()
    scene.run(2.0)
    scene.run(3.0, same_pose([]))
    assert any("the same pose is sent while the head moves" in line for line in scene.events)
    assert scene.pose.fault() is not None


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda t, s: [
                replace(s, position_m=MIRROR @ s.position_m, rotation=MIRROR @ s.rotation @ MIRROR)
            ],
            r"turned by \+\d+ degrees",
        ),
        (
            lambda t, s: [replace(s, position_m=MIRROR @ s.position_m)],
            "mirrored axes|wrong frame",
        ),
        (lambda t, s: [replace(s, position_m=1e3 * s.position_m)], "wrong scale"),
        (
            lambda t, s: [replace(s, position_m=turned((0.0, 0.0, 90.0)) @ s.position_m)],
            r"wrong frame: the head moves [+-]\d+ degrees off",
        ),
    ],
)
def test_a_wrong_frame_from_the_start_is_named(change: Change, said: str) -> None:
    scene = Scene()
    try:
        scene.run(5.0, change)
        fault = scene.pose.fault()
    except InputError as error:
        fault = str(error)
    assert fault is not None
    assert re.search(said, fault), fault


@pytest.mark.parametrize("offset_m", [[0.0, 0.4, 0.0], [-0.3, 0.0, 0.0]])
def test_a_start_elsewhere_is_rejected(offset_m: list[float]) -> None:
    with pytest.raises(InputError, match=r"lies 0\.(4|3)0 m from the start of the run, turned by"):
        Scene().run(1.0, lambda time_s, sample: [moved(sample, offset_m)])


def test_the_accuracy_grows_with_the_distance_from_the_start() -> None:
    scene = Scene()
    scene.run(7.0)
    near = scene.pose.position_sd_m
    scene.run(8.0)
    assert scene.pose.row()["is_confirmed"]
    assert scene.pose.position_sd_m > 1.3 * near


@pytest.mark.costs("feeds poses and joints for a long walk")
def test_a_turn_at_the_start_makes_the_accuracy_worse() -> None:
    """Nothing shows whether the robot lies turned, or its source's frame is."""
    turn = turned((0.0, 0.0, 10.0))

    def in_turned_frame(time_s: float, sample: PoseSample) -> list[PoseSample]:
        place_m = turn @ sample.position_m
        return [replace(sample, position_m=place_m, rotation=turn @ sample.rotation)]

    sound, wrong = Scene(), Scene()
    sound.run(12.0)
    wrong.run(12.0, in_turned_frame)
    assert wrong.pose.fault() is None
    assert wrong.errors_m[-1] < 2.0 * wrong.pose.position_sd_m
    assert wrong.pose.position_sd_m > 1.5 * sound.pose.position_sd_m


@pytest.mark.costs("feeds poses and joints for a long walk")
def test_the_accuracy_contains_how_accurately_a_robot_is_laid_down() -> None:
    """A robot that lies as far off as the frame hides it, unless the frame was measured."""
    stated_m = []
    for world_sd_deg in (10.0, 1.0):
        scene = Scene(PoseConfig(latency_s=0.06, world_sd_deg=world_sd_deg))
        scene.run(6.0)
        stated_m.append(scene.pose.position_sd_m)
    away_m = np.hypot(*scene.pose(joint_state(6.0)).head_in_world_m[:2])
    # of two priors of 10 and 5 degrees, and of 1 and 5 degrees
    hidden_deg = np.sqrt(10.0**2 * 5.0**2 / 125.0 - 1.0**2 * 5.0**2 / 26.0)
    more_m = np.sqrt(stated_m[0] ** 2 - stated_m[1] ** 2)
    assert more_m == pytest.approx(np.radians(hidden_deg) * away_m, rel=0.05)


def test_the_heading_of_the_start_is_the_mean_of_the_poses_at_rest() -> None:
    """The first pose is 18 degrees off by noise, the mean of the others 1 degree."""
    scene = Scene(begins_s=0.3)

    def noisy(time_s: float, sample: PoseSample) -> list[PoseSample]:
        turn = turned((0.0, 0.0, 18.0 if time_s == 0.0 else 0.0))
        return [replace(sample, rotation=turn @ sample.rotation)]

    scene.run(7.0, noisy)
    sound = Scene(begins_s=0.3)
    sound.run(7.0)
    assert scene.pose.position_sd_m < 1.1 * sound.pose.position_sd_m


def test_a_fast_curl_before_the_delay_is_known_leaves_no_jump() -> None:
    """Late poses show the head as it lay before; when it rests, the next ones are right."""
    scene = Scene(PoseConfig(), delay_s=0.1, noise_m=0.01, begins_s=0.3, pace=6.0, rest_s=0.8)
    scene.run(1.5)
    assert scene.events == []
    assert scene.headings_rad[-1] < 0.03


def test_the_mean_heading_before_the_first_motion_is_compared_with_the_start() -> None:
    """A first pose that is right by noise does not hide a frame that is turned by 30 degrees."""
    scene = Scene(begins_s=0.3)
    angles_deg = iter([12.0, 38.0])

    def noisy(time_s: float, sample: PoseSample) -> list[PoseSample]:
        turn = turned((0.0, 0.0, next(angles_deg, 30.0)))
        return [replace(sample, rotation=turn @ sample.rotation)]

    with pytest.raises(InputError, match=r"turned by \+2[45] degrees"):
        scene.run(0.3, noisy)


@pytest.mark.costs("feeds poses and joints for a long walk")
def test_drift_in_motion_makes_the_accuracy_worse() -> None:
    """A source that drifts to the side by 2 cm/s from 6 s on."""

    def drifting(time_s: float, sample: PoseSample) -> list[PoseSample]:
        return [moved(sample, [0.0, 0.02 * max(time_s - 6.0, 0.0), 0.0])]

    scene = Scene()
    scene.run(26.0, drifting)
    assert scene.pose.fault() is None
    assert scene.errors_m[-1] > 0.3
    assert scene.errors_m[-1] < 2.0 * scene.pose.position_sd_m


def test_a_good_source_is_never_called_wrong() -> None:
    scene = Scene(PoseConfig(), noise_m=0.02, delay_s=0.2)
    scene.run(7.0)
    assert scene.pose.fault() is None
    assert scene.events == []


def test_swapped_markers_are_bridged() -> None:
    scene = Scene()
    scene.run(3.0)
    scene.run(0.2, lambda t, s: [moved(s, [0.2, 0.2, 0.0])])
    scene.run(1.0)
    assert scene.pose.fault() is None
    assert any(line.startswith("jump by 0.28 m") for line in scene.events)
    assert max(scene.errors_m[100:]) < 0.02


def test_a_second_sender_is_reported_and_ignored() -> None:
    scene = Scene()
    scene.run(1.0)
    scene.run(
        1.0,
        lambda t, s: [s, ArrivedPose(t + 0.06, "10.0.0.9:77", moved(s, [0.05, 0.0, 0.0]))],
    )
    assert scene.pose.fault() is None
    assert sum(line.startswith("two senders: 10.0.0.9:77 is ignored") for line in scene.events) == 1
    assert scene.errors_m[-1] < 0.01


def test_a_restarted_sender_is_reported_and_used() -> None:
    scene = Scene()
    scene.run(2.0)
    first = scene.cycles
    scene.run(1.0, lambda t, s: [replace(s, sequence=s.sequence - first, time_s=s.time_s - 1000.0)])
    assert scene.pose.fault() is None
    assert [line for line in scene.events if line.startswith("restarted sender")] == [
        "restarted sender: its sequence begins again at 0; its clock is estimated again"
    ]
    assert scene.pose.counts["restarts"] == 1
    assert scene.pose.counts["used"] > 140


def test_a_sender_with_a_new_port_replaces_a_silent_one() -> None:
    scene = Scene()
    scene.run(2.0)
    scene.run(1.2, lambda t, s: [])
    scene.run(
        1.0, lambda t, s: [ArrivedPose(t + 0.06, "10.0.0.1:6001", replace(s, sequence=1))][:1]
    )
    assert any("another sender on the same host, 10.0.0.1:6001" in line for line in scene.events)


def test_a_clock_that_is_set_back_is_estimated_again() -> None:
    scene = Scene()
    scene.run(2.0)
    scene.run(2.0, lambda t, s: [replace(s, time_s=s.time_s - 10.0)])
    assert scene.pose.fault() is None
    assert scene.events == [
        "restarted sender: its clock was set back by 10.0 s; its clock is estimated again"
    ]
    assert scene.errors_m[-1] < 0.02


def test_another_program_before_the_source_does_not_become_the_sender() -> None:
    scene = Scene()
    scene.run(0.5, lambda t, s: [ArrivedPose(t, "10.0.0.9:77", UnusablePoseError("no JSON")), s])
    scene.run(1.0)
    assert scene.pose.fault() is None
    assert scene.errors_m[-1] < 0.01


def test_lost_and_repeated_poses_are_counted() -> None:
    scene = Scene()
    scene.run(2.0, lambda t, s: [] if s.sequence % 10 == 5 else [s, s])
    assert scene.pose.facts()["poses_lost"] == 10
    assert scene.pose.fault() is None
    assert any("twice or out of order" in line for line in scene.events)


def test_a_large_covariance_moves_the_pose_less() -> None:
    ends = []
    for sd_m in (0.005, 0.3):
        scene = Scene()
        scene.run(2.0)
        covariance = np.diag([sd_m**2] * 3 + [0.05**2] * 3)
        scene.run(
            0.3,
            lambda t, s, c=covariance: [replace(moved(s, [0.06, 0.0, 0.0]), covariance=c)],  # type: ignore[misc]
        )
        ends.append(scene.errors_m[-1])
    assert ends[0] > 0.03 > 0.01 > ends[1]


def test_a_body_on_another_link_in_a_turned_frame_gives_the_same_pose() -> None:
    config = PoseConfig(
        link=5, offset_m=(0.01, -0.02, 0.04), offset_deg=(0.0, 0.0, 90.0), world_m=(2.0, -1.0, 0.5),
        world_deg=(90.0, 0.0, 30.0), latency_s=0.06,
    )  # fmt: skip
    scene = Scene(config)
    scene.run(3.0)
    assert scene.pose.fault() is None
    assert scene.errors_m[-1] < 0.01


def test_a_body_that_rolls_over_is_followed() -> None:
    scene = Scene()
    scene.run(3.0)

    def roll(time_s: float, sample: PoseSample) -> list[PoseSample]:
        heading = np.arctan2(sample.rotation[1, 0], sample.rotation[0, 0])
        heading += mean_heading_rad(ROBOT, joint_state(time_s).position_rad)
        turn_rad = np.radians(min(300.0 * (time_s - 3.0), 170.0))
        along = turn_rad * np.array([np.cos(heading), np.sin(heading), 0.0])
        return [replace(sample, rotation=rotation_by(along) @ sample.rotation)]

    scene.run(4.0, roll)
    assert scene.events == []
    assert scene.pose.fault() is None
    assert scene.pose(joint_state(scene.cycles * CYCLE_S)).rotation[2, 2] < -0.9
