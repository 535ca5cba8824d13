"""The frames of the links, put one upon the other, give the forward kinematics again."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.loader import load_robot
from snakewalk.controller.exchange.body_frames import WORLD, body_frames
from snakewalk.controller.kinematics.legs import leg_segments_m
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.drivers.types import BodyPose


def link_centres_m(record: RunRecord) -> np.ndarray:
    """(T, L, 3) centres of the links, from the frames alone."""
    frames = body_frames(record)
    assert frames.parents == (WORLD, *frames.names[:-1])
    at, turn = np.zeros(3), Rotation.identity(len(frames.time_s))
    centres = []
    for link in range(len(frames.names)):
        at = at + turn.apply(frames.translation_m[:, link])
        turn = turn * Rotation.from_quat(frames.quaternion[:, link])
        back = 0.0 if link == 0 else -0.5 * record.header.robot.mean_link_length_m
        centres.append(at + turn.apply([back, 0.0, 0.0]))
    return np.stack(centres, axis=1)


def test_the_frames_chain_to_the_links_that_the_log_holds(record: RunRecord) -> None:
    # the log rounds to a micrometre and a microradian, and the body is 17 links long
    np.testing.assert_allclose(link_centres_m(record), record.pose.links_m, atol=2e-5)


def test_without_a_pose_the_head_stands_at_the_origin(record: RunRecord) -> None:
    pose = record.pose
    none = {name: getattr(pose, name)[:0] for name in pose.__slots__}
    frames = body_frames(replace(record, pose=replace(pose, **none)))
    np.testing.assert_array_equal(frames.time_s, record.cycle.time_s)
    np.testing.assert_array_equal(frames.translation_m[:, 0], 0.0)
    np.testing.assert_array_equal(frames.quaternion[:, 0], [[0.0, 0.0, 0.0, 1.0]] * 20)


def test_legs_hang_on_the_spine_where_their_segments_are(record: RunRecord) -> None:
    """The same angles on a robot of as many joints, half of them in legs."""
    robot = load_robot("salamander")
    assert robot.joint_count == record.cycle.measured_rad.shape[1]
    legged = replace(record, header=replace(record.header, robot=robot))
    frames = body_frames(legged)
    at, turn = [np.zeros(3)], [Rotation.identity()]
    row = 7
    for link, parent in enumerate(frames.parents):
        before = 1 + frames.names.index(parent) if parent != WORLD else 0
        at.append(at[before] + turn[before].apply(frames.translation_m[row, link]))
        turn.append(turn[before] * Rotation.from_quat(frames.quaternion[row, link]))
    pose = BodyPose(0.0, record.pose.head_m[row], record.pose.rotation[row])
    time_s, cycle = frames.time_s[row], record.cycle
    angles = [
        np.interp(time_s, cycle.time_s, each) if np.isfinite(each).all() else 0.0
        for each in cycle.measured_rad.T
    ]
    ends_m = leg_segments_m(robot, body_in_world(robot, pose, np.array(angles)), np.array(angles))
    np.testing.assert_allclose(at[1 + robot.link_count :], ends_m[:, 0], atol=1e-6)
