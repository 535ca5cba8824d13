"""The body as it lies in the world: the measured head pose carried along the measured joints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from config.robot import RobotConfig
from drivers.types import BodyPose

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BodyView:
    """Where every link is, in the world."""

    link_m: Floats
    """(L, 3) centres of the links, head first."""
    forward: Floats
    """(L, 3) unit vectors along the links, in the direction of travel."""
    centre_m: Floats
    """(3,) centre of mass of equal links; [PT] 2.6.2 calls it S_k."""

    @property
    def headings_rad(self) -> Floats:
        """(L,) unwrapped headings of the links in the horizontal plane."""
        angles = np.arctan2(self.forward[:, 1], self.forward[:, 0])
        turns = np.rint(
            (angles[1:] - angles[:-1]) / (2.0 * np.pi)
        )  # np.unwrap takes 4 times longer
        angles[1:] -= 2.0 * np.pi * turns.cumsum()
        return np.asarray(angles)

    def way_since_m(self, before: "BodyView") -> float:
        """How far the links have gone along themselves since ``before``, mean over the body."""
        return float(((self.link_m - before.link_m) * self.forward).sum() / len(self.link_m))


def body_in_world(robot: RobotConfig, pose: BodyPose, joint_rad: Floats) -> BodyView:
    """Forward kinematics from the head pose and joint angles (J,).

    Yaw turns the link behind by ``-q`` about the up axis, pitch by ``+q`` about the left axis, so a
    positive joint bends the head side to the left, or lifts it.
    """
    # The axes in plain floats: seventeen steps in a row, in every control cycle
    rows = np.asarray(pose.rotation, dtype=float).T.tolist()
    (fx, fy, fz), (lx, ly, lz), (ux, uy, uz) = rows
    axes = [fx, fy, fz]
    turns = zip(np.cos(joint_rad).tolist(), np.sin(joint_rad).tolist(), strict=True)
    for axis, (c, s) in zip(robot.joint_axes, turns, strict=True):
        if axis == "y":
            fx, lx = c * fx - s * lx, s * fx + c * lx
            fy, ly = c * fy - s * ly, s * fy + c * ly
            fz, lz = c * fz - s * lz, s * fz + c * lz
        else:
            fx, ux = c * fx - s * ux, s * fx + c * ux
            fy, uy = c * fy - s * uy, s * fy + c * uy
            fz, uz = c * fz - s * uz, s * fz + c * uz
        axes += (fx, fy, fz)
    forward = np.array(axes).reshape(-1, 3)
    link_m = np.empty_like(forward)
    link_m[0] = 0.0
    (forward[:-1] + forward[1:]).cumsum(axis=0, out=link_m[1:])
    link_m *= -0.5 * robot.link_length_m
    link_m += pose.head_in_world_m
    return BodyView(link_m, forward, link_m.sum(axis=0) / len(link_m))
