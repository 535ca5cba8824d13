"""The frames of the links, put one upon the other, give the forward kinematics again."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.controller.app.exports.body_frames import WORLD, body_frames
from snakewalk.controller.runlog.record import RunRecord


def link_centres_m(record: RunRecord) -> np.ndarray:
    """(T, L, 3) centres of the links, from the frames alone."""
    frames = body_frames(record)
    assert frames.parents == (WORLD, *frames.names[:-1])
    at, turn = np.zeros(3), Rotation.identity(len(frames.time_s))
    centres = []
    for link in range(len(frames.names)):
        at = at + turn.apply(frames.translation_m[:, link])
        turn = turn * Rotation.from_quat(frames.quaternion[:, link])
        back = 0.0 if link == 0 else -0.5 * record.header.robot.link_length_m
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
