"""One cycle of an action, or a brake, in the body frame ([YT] 3.1, Eq. 6-8, corrected)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.frame import Frame

Kind = Literal[
    "forward", "left", "right", "reverse", "reverse-left", "reverse-right", "brake", "rest"
]
SIDES: dict[str, int] = {"left": 1, "right": -1, "reverse-left": 1, "reverse-right": -1}
"""Side to which the heading turns: 1 is left."""
REVERSE = ("reverse", "reverse-left", "reverse-right")
"""[YT] 3.2: forward and turns; retreating and braking, which the paper makes from forward; and
rest, the state after a brake. All but a brake are one settled cycle."""


@dataclass(frozen=True, slots=True)
class Segment:
    """T frames; frame k goes from pose k to pose k + 1, and its shape is that of pose k + 1."""

    name: str
    kind: Kind
    frame_s: float
    """Time of a frame."""
    turn: Floats
    """(T, 3, 3) ``R^T R'``: the rotation seen from the body. Eq. 6's ``R' R^T`` is one in the world
    and holds for the recorded heading alone."""
    move_m: Floats
    """(T, 3) ``R^T (o' - o)``, Eq. 7."""
    link_m: Floats
    """(T, L, 3) centres of the links in the body frame, Eq. 8."""
    link_rotation: Floats
    """(T, L, 3, 3) axes of the links in the body frame."""
    goal_rad: Floats
    """(T, J) joint goals in force when each frame begins."""
    joint_rad: Floats
    """(T, J) joint angles at the end of each frame."""
    closure_m: float
    """Largest distance of a link, in the body frame, between the first and the last pose."""
    closure_rad: float
    """Largest difference of a joint between the segment's begin and end."""

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.move_m)

    @property
    def duration_s(self) -> float:
        """Duration of a cycle."""
        return self.frames * self.frame_s

    def travel(self) -> tuple[Floats, Floats]:
        """Poses in the frame of pose 0: rotations (T + 1, 3, 3) and origins (T + 1, 3)."""
        rotation = np.empty((self.frames + 1, 3, 3))
        origin = np.zeros((self.frames + 1, 3))
        rotation[0] = np.eye(3)
        for k in range(self.frames):
            rotation[k + 1] = rotation[k] @ self.turn[k]
            origin[k + 1] = origin[k] + rotation[k] @ self.move_m[k]
        return rotation, origin

    def flat_travel(self) -> Floats:
        """(T + 1, 3) x, y and unwrapped heading of the poses in the frame of pose 0."""
        rotation, origin = self.travel()
        heading = np.unwrap(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]))
        return np.column_stack([origin[:, :2], heading])

    @property
    def speed_m_s(self) -> float:
        """Distance of a cycle over its time, along the arc; negative where it goes tail first."""
        x, y, turn = self.flat_travel()[-1]
        half = 0.5 * float(turn)
        distance_m = float(np.copysign(np.hypot(x, y), x))
        return distance_m / float(np.sinc(half / np.pi)) / self.duration_s

    @property
    def turn_rad_s(self) -> float:
        """Turn of a cycle over its time, positive to the left."""
        return float(self.flat_travel()[-1, 2]) / self.duration_s


def cut(
    name: str,
    kind: Kind,
    frame_s: float,
    frames: Sequence[Frame],
    link_m: Floats,
    link_rotation: Floats,
    goal_rad: Floats,
    joint_rad: Floats,
) -> Segment:
    """Make a segment of T + 1 poses in the world.

    Args:
        name: of the action.
        kind: its motion type.
        frame_s: time between poses.
        frames: T + 1 body frames.
        link_m: (T + 1, L, 3) in the world.
        link_rotation: (T + 1, L, 3, 3) in the world.
        goal_rad: (T, J)
        joint_rad: (T + 1, J)

    """
    rotation = np.array([frame.rotation for frame in frames])
    origin = np.array([frame.origin_m for frame in frames])
    back = rotation.transpose(0, 2, 1)
    shape_m = np.einsum("tij,tlj->tli", back, link_m - origin[:, None])
    return Segment(
        name,
        kind,
        frame_s,
        turn=back[:-1] @ rotation[1:],
        move_m=np.einsum("tij,tj->ti", back[:-1], np.diff(origin, axis=0)),
        link_m=shape_m[1:],
        link_rotation=(back[:, None] @ link_rotation)[1:],
        goal_rad=np.array(goal_rad),
        joint_rad=np.array(joint_rad[1:]),
        closure_m=float(np.linalg.norm(shape_m[-1] - shape_m[0], axis=1).max()),
        closure_rad=float(np.abs(joint_rad[-1] - joint_rad[0]).max()),
    )
