"""A height field that is level is the floor; one that is tilted is a ramp."""

import numpy as np

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.heightfield import HeightField
from tests.helpers.physics import ROBOT, a_body, a_drive, link_rotations, serpenoid

START = np.array([-0.5 * ROBOT.joint_count * ROBOT.mean_link_length_m, 0.0, 0.0])
"""Centre of a straight body with its head at 0."""


def slope(rise: float) -> HeightField:
    """4 m square around 0 that rises along x by ``rise`` per metre."""
    x = np.linspace(-2.0, 2.0, 41)
    return HeightField(np.tile(rise * x, (41, 1)), 0.1, -2.0, -2.0)


def test_a_level_height_field_is_the_floor() -> None:
    floor, field = a_body(), a_body(ground=slope(0.0))
    for body in (floor, field):
        drive = a_drive()
        for k in range(1, 151):
            drive.goal_rad[:] = serpenoid(0.02 * k)
            body.advance(0.02 * k, drive)
    way, other = (body.link_positions_m.mean(axis=0) for body in (floor, field))
    way, other = way - START, other - START
    turned = floor.head_pose().rotation.T @ field.head_pose().rotation
    angle = float(np.arctan2(turned[1, 0], turned[0, 0]))
    print(f"after {way[0]:.3f} m: {(other - way) * 1e3} mm apart, turned by {angle:.4f} rad")
    assert way[0] > 0.5
    assert abs(other[0] - way[0]) < 0.005 * way[0]
    assert np.abs(other - way).max() < 0.02 * way[0]
    assert abs(angle) < 0.02
    assert abs(other[2] - way[2]) < 1e-4


def test_on_a_ramp_it_holds_below_the_friction_angle_and_slides_above() -> None:
    """Down at ``g (sin a - mu cos a)``; "holds" is a creep that shrinks with the step."""
    mu, drive = 0.2, a_drive()
    held = a_body((mu, mu), ground=slope(0.15))
    x0 = held.link_positions_m[0, 0]
    held.advance(0.5, drive)
    crept = (
        GRAVITY_M_S2 * np.sin(np.arctan(0.15)) * held.step_s / 0.6 * 0.5
    )  # the drag of a straight body
    np.testing.assert_allclose(x0 - held.link_positions_m[0, 0], crept, rtol=0.03)
    slid = a_body((mu, mu), ground=slope(0.4))
    start = slid.link_positions_m.mean(axis=0)
    slid.advance(0.5, drive)
    angle = np.arctan(0.4)
    pull = GRAVITY_M_S2 * (np.sin(angle) - mu * np.cos(angle))
    way = np.linalg.norm(slid.link_positions_m.mean(axis=0) - start)
    np.testing.assert_allclose(way, 0.5 * pull * 0.5**2, rtol=0.03)


def test_the_head_pose_is_that_of_the_head_link() -> None:
    body, drive = a_body(ground=slope(0.1)), a_drive()
    drive.goal_rad[:] = serpenoid(1.0)
    body.advance(0.2, drive)
    pose = body.head_pose()
    np.testing.assert_allclose(pose.rotation.T @ pose.rotation, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(pose.head_in_world_m, body.link_positions_m[0], atol=1e-12)
    np.testing.assert_allclose(pose.rotation, link_rotations(body)[0], atol=1e-12)
