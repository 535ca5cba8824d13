"""The body as it lies in the world: the measured head pose carried along the measured joints."""

from dataclasses import dataclass
from functools import cache

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
        way_m = (self.link_m - before.link_m).ravel().dot(self.forward.ravel())
        return float(way_m) / len(self.link_m)


def body_in_world(robot: RobotConfig, pose: BodyPose, joint_rad: Floats) -> BodyView:
    """Forward kinematics from the head pose and joint angles (J,).

    Yaw turns the link behind by ``-q`` about the up axis, pitch by ``+q`` about the left axis, so a
    positive joint bends the head side to the left, or lifts it.
    """
    if "p" in robot.joint_axes:
        forward = _forward(robot.joint_axes, pose.rotation, joint_rad)
    else:
        forward = _forward_in_plane(pose.rotation, joint_rad)
    placed = _centres(len(forward), robot.link_length_m).dot(forward)
    placed += pose.head_in_world_m
    return BodyView(placed[:-1], forward, placed[-1])


def _forward(joint_axes: str, rotation: Floats, joint_rad: Floats) -> Floats:
    """(L, 3) link axes of any chain, in plain floats: one turn after the other."""
    rows = np.asarray(rotation, dtype=float).T.tolist()
    (fx, fy, fz), (lx, ly, lz), (ux, uy, uz) = rows
    axes = [fx, fy, fz]
    turns = zip(np.cos(joint_rad).tolist(), np.sin(joint_rad).tolist(), strict=True)
    for axis, (c, s) in zip(joint_axes, turns, strict=True):
        if axis == "y":
            fx, lx = c * fx - s * lx, s * fx + c * lx
            fy, ly = c * fy - s * ly, s * fy + c * ly
            fz, lz = c * fz - s * lz, s * fz + c * lz
        else:
            fx, ux = c * fx - s * ux, s * fx + c * ux
            fy, uy = c * fy - s * uy, s * fy + c * uy
            fz, uz = c * fz - s * uz, s * fz + c * uz
        axes += (fx, fy, fz)
    return np.array(axes).reshape(-1, 3)


def _forward_in_plane(rotation: Floats, joint_rad: Floats) -> Floats:
    """The same for yaw joints alone: all turn about the head's up axis, so that angles add up."""
    links = len(joint_rad) + 1
    turn_rad = _sums(links).dot(joint_rad)
    turned = np.empty((links, 2))
    np.cos(turn_rad, out=turned[:, 0])
    np.sin(turn_rad, out=turned[:, 1])
    return np.asarray(turned.dot(rotation.T[:2]))


@cache
def _sums(links: int) -> Floats:
    """(L, L - 1) weights of the yaw joints in the heading of each link, from the head's on."""
    return -np.tri(links, links - 1, k=-1)


@cache
def _centres(links: int, link_m: float) -> Floats:
    """(L + 1, L) weights of the links' axes in the place of each centre, last in their mean."""
    whole = np.tri(links, k=-1)  # of every link before, but for half of the head's
    whole[1:, 0] = 0.5
    own = 0.5 * np.eye(links)
    own[0, 0] = 0.0  # places are from the head's centre on
    weights = -link_m * (whole + own)
    return np.vstack([weights, weights.mean(axis=0)])
