"""A segment along an arc: speed, turn, shapes and closure by closed forms."""

import numpy as np
import pytest

from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.repertoire.segment import Segment, cut

FRAMES, FRAME_S = 24, 0.05
LINK_M = np.array([[0.2, 0.0, 0.01], [0.0, 0.1, 0.0], [-0.2, 0.0, 0.02]])


def on_arc(speed_m_s: float, turn_rad_s: float, heading_rad: float = 0.4) -> Segment:
    """A rigid body that goes at constant speed along a circle, or a line without a turn."""
    time_s = FRAME_S * np.arange(FRAMES + 1)
    heading = heading_rad + turn_rad_s * time_s
    radius_m = speed_m_s / turn_rad_s
    x = 1.0 + radius_m * (np.sin(heading) - np.sin(heading_rad))
    y = -2.0 - radius_m * (np.cos(heading) - np.cos(heading_rad))
    frames = [Frame.flat(*place, z_m=0.3) for place in zip(x, y, heading, strict=True)]
    links = np.array([frame.to_world_m(LINK_M) for frame in frames])
    axes = np.array([np.tile(frame.rotation, (3, 1, 1)) for frame in frames])
    joints = np.linspace([0.1, 0.2], [0.4, -0.3], FRAMES + 1)
    return cut("arc", "left", FRAME_S, frames, links, axes, joints[:-1] + 1.0, joints)


@pytest.mark.parametrize("speed_m_s", [0.3, -0.2])
@pytest.mark.parametrize("turn_rad_s", [1.1, -0.5, 1e-6, 4.0])
def test_speed_and_turn_are_those_along_the_arc(speed_m_s: float, turn_rad_s: float) -> None:
    segment = on_arc(speed_m_s, turn_rad_s)
    assert segment.frames == FRAMES
    assert segment.duration_s == pytest.approx(1.2)
    assert segment.turn_rad_s == pytest.approx(turn_rad_s)
    if abs(turn_rad_s) < 2.0:  # the chord tells forward from backward
        assert segment.speed_m_s == pytest.approx(speed_m_s, rel=1e-6)


def test_poses_begin_at_the_first_and_follow_the_circle() -> None:
    turned = np.linspace(0.0, 4.8, FRAMES + 1)
    expected = np.column_stack(
        [0.3 / 4.0 * np.sin(turned), 0.3 / 4.0 * (1.0 - np.cos(turned)), turned]
    )
    segment = on_arc(0.3, 4.0)
    np.testing.assert_allclose(segment.flat_travel(), expected, atol=1e-12)
    rotation, origin_m = segment.travel()
    np.testing.assert_allclose(rotation @ rotation.transpose(0, 2, 1), [np.eye(3)] * 25, atol=1e-12)
    np.testing.assert_allclose(origin_m[:, 2], 0.0, atol=1e-12)


def test_a_rigid_body_has_one_shape_in_its_own_frame() -> None:
    segment = on_arc(0.3, 1.1)
    np.testing.assert_allclose(segment.link_m, [LINK_M] * FRAMES, atol=1e-12)
    np.testing.assert_allclose(segment.link_rotation, [[np.eye(3)] * 3] * FRAMES, atol=1e-12)
    assert segment.closure_m == pytest.approx(0.0, abs=1e-12)
    assert segment.closure_rad == pytest.approx(0.5)
    np.testing.assert_allclose(segment.joint_rad[[0, -1]], [[0.1125, 0.2 - 0.5 / 24], [0.4, -0.3]])
    np.testing.assert_allclose(segment.goal_rad[0], [1.1, 1.2])


def test_closure_is_the_farthest_link_between_the_first_and_the_last_shape() -> None:
    still = [Frame.flat(0.0, 0.0, 0.0)] * 3
    away = np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 4.0], [1.0, 0.0, 0.0]])
    links = np.array([LINK_M, LINK_M + 9.0, LINK_M + away])
    joints = np.zeros((3, 2))
    axes = np.tile(np.eye(3), (3, 3, 1, 1))
    assert cut("still", "rest", 0.1, still, links, axes, joints[1:], joints).closure_m == 5.0
