"""Directions of a chain that lies straight: forward, left and up, from the axes of its hinges."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.exchange.robot_import.body_tree import Hinge

ROUNDED_RAD = 0.01
"""Angle by which neighbouring axes may miss 0 or 90 degrees: 1.57 misses by 0.0008 (ours)."""
TOLD_RAD = 1e-6
"""Smaller deviations are not reported (ours)."""


@dataclass(frozen=True, slots=True)
class ChainDirections:
    """Unit vectors of a straight chain at zero angles, and the kind of each joint."""

    forward: Floats
    left: Floats
    up: Floats
    yaws: tuple[bool, ...]
    """Whether each hinge is a yaw joint, in the order of the hinges."""

    def is_yaw(self, axis: Floats) -> bool:
        """Whether an axis is rather upright than sideways."""
        return abs(float(axis @ self.up)) > abs(float(axis @ self.left))


def chain_directions(
    hinges: list[Hinge], first_to_last_m: Floats, reverse: bool, notes: list[str]
) -> ChainDirections:
    """Directions of the chain, first body first, or last with ``reverse``.

    Args:
        hinges: of the spine.
        first_to_last_m: from the centre of mass of the first body to that of the last; it shows the
            direction if all hinges are at one place.
        reverse: the first body is the tail.
        notes: list to which each change is added.

    Raises:
        InputError: an axis lies along the body, or is neither parallel to its neighbour nor at a
            right angle to it.

    """
    if len(hinges) < 2:
        raise InputError(
            "a chain of one hinge: states no direction of its body; a robot has two hinges or more"
        )
    kinds = _kinds(hinges, notes)
    first = _mean_axis([hinge.axis for hinge, kind in zip(hinges, kinds, strict=True) if not kind])
    others = [hinge.axis for hinge, kind in zip(hinges, kinds, strict=True) if kind]
    chord = hinges[0].anchor_m - hinges[-1].anchor_m
    if np.linalg.norm(chord) < 1e-9:
        chord = -first_to_last_m
    if others:
        across = _mean_axis(others)
        across -= (across @ first) * first
        across /= np.linalg.norm(across)
        forward = np.cross(first, across)
        forward *= math.copysign(1.0, float(forward @ chord))
    else:
        across = None
        forward = chord - (chord @ first) * first
    size = float(np.linalg.norm(forward))
    if size < 1e-9 or abs(float(forward / size @ chord)) < 1e-9:
        raise InputError(
            f"joint {hinges[0].name}: its axis lies along the body; joints yaw or pitch"
        )
    forward = (-1.0 if reverse else 1.0) * forward / size
    up = _up_direction(first, across, forward, hinges[0].name, notes)
    up = up - (up @ forward) * forward
    up /= np.linalg.norm(up)
    first_is_yaw = abs(float(first @ up)) > math.sqrt(0.5)
    return ChainDirections(
        forward, np.cross(up, forward), up, tuple(first_is_yaw != kind for kind in kinds)
    )


def _kinds(hinges: list[Hinge], notes: list[str]) -> list[bool]:
    """Whether each axis is at a right angle to the first, by its neighbours' directions."""
    kinds = [False]
    across = None
    off_neighbour, off_first = 0.0, 0.0
    for before, hinge in pairwise(hinges):
        off = math.acos(min(abs(float(before.axis @ hinge.axis)), 1.0))
        turns = off > math.pi / 4
        deviation = math.pi / 2 - off if turns else off
        kind = kinds[-1] != turns
        if deviation <= ROUNDED_RAD and kind:
            across = hinge.axis if across is None else across
            deviation = max(deviation, _angle_off(hinge.axis, across, len(kinds)))
        if deviation > ROUNDED_RAD:
            raise InputError(
                f"joint {hinge.name}: its axis is {math.degrees(off):.3g} degrees from that of "
                f"{before.name}: neither parallel to it nor at a right angle to it and to the "
                "body; joints yaw or pitch"
            )
        kinds.append(kind)
        off_neighbour = max(off_neighbour, abs(math.pi / 2 - off) if turns else off)
        first = abs(float(hinges[0].axis @ hinge.axis))
        off_first = max(
            off_first, math.asin(min(first, 1.0)) if kind else math.acos(min(first, 1.0))
        )
    if off_neighbour > TOLD_RAD or off_first > TOLD_RAD:
        notes.append(
            f"axes are rounded: up to {off_neighbour:.2g} rad from right angles or parallels "
            f"between neighbours, up to {off_first:.2g} rad along the chain"
        )
    return kinds


def _angle_off(axis: Floats, across: Floats, steps: int) -> float:
    return math.acos(min(abs(float(axis @ across)), 1.0)) / max(steps, 1)


def _mean_axis(axes: list[Floats]) -> Floats:
    total = np.sum([math.copysign(1.0, float(axis @ axes[0])) * axis for axis in axes], axis=0)
    return np.asarray(total / np.linalg.norm(total))


def _up_direction(
    first: Floats, across: Floats | None, forward: Floats, name: str, notes: list[str]
) -> Floats:
    axes = [first] if across is None else [first, across]
    upright = [abs(float(axis[2])) for axis in axes]
    if max(upright) > math.sqrt(0.5) or len(axes) == 2:
        up = axes[int(np.argmax(upright))]
        if max(upright) <= math.sqrt(0.5):
            notes.append(f"no axis is vertical in the model: that of {name} is assumed to be yaw")
            up = axes[0]
        return up * math.copysign(1.0, float(up[2]) or 1.0)
    if abs(float(forward[2])) > math.sqrt(0.5):
        notes.append("the body stands upright in the model: its joints are assumed to be yaw")
        return first
    up = np.cross(forward, first)
    return up * math.copysign(1.0, float(up[2]))
