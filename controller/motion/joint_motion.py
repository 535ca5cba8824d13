"""Joint angles over time from another program's file, and their mapping to a robot's joints.

A reader is a plug-in of the kind ``joints`` (``docs/how-to/add-a-plug-in.md``).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig

UNITS: Final = {"rad": 1.0, "deg": np.pi / 180.0}
"""Units of angles and their size in radians."""
MOST_CELLS: Final = 20_000_000
"""Angles of a motion (ours): an hour of 50 joints at 100 Hz."""
REST: Final = "rest"
"""Name that keeps a joint of the robot at 0."""
_STILL_RAD: Final = 1e-6


@dataclass(frozen=True, slots=True)
class JointRequest:
    """Choices of the user that a file may not state."""

    unit: str | None = None
    """One of ``UNITS``."""
    topic: str | None = None
    """Topic of a bag."""
    episode: int | None = None
    """Episode of a dataset."""


@dataclass(frozen=True, slots=True)
class JointMotion:
    """Named joint angles over time."""

    time_s: Floats
    """(T,) increasing, from 0 s."""
    names: tuple[str, ...]
    """Names of the K joints of the file."""
    joint_rad: Floats
    """(T, K)"""
    notes: tuple[str, ...] = ()
    """Lines about parts that the reader left out, changed or assumed."""


class JointReader(Protocol):
    """Reader of a kind of file, provided by a plug-in of the kind ``joints``."""

    def accepts(self, path: Path, head: bytes) -> bool:
        """Whether a path is of this kind; ``head`` contains its first bytes, empty for a folder."""
        ...

    def read(self, path: Path, request: JointRequest) -> JointMotion:
        """Read the joint angles.

        Raises:
            InputError: a fault of the file, or a choice that it needs.

        """
        ...


def likely_unit(angles: Floats) -> tuple[str, float]:
    """Return the probable unit of angles without one, and the largest angle."""
    largest = float(np.nanmax(np.abs(angles), initial=0.0))
    return ("deg" if largest > 2.0 * np.pi else "rad"), largest


def joint_motion(
    path: Path,
    time_s: Floats,
    names: Sequence[str],
    joint_rad: Floats,
    notes: Sequence[str] = (),
) -> JointMotion:
    """Check angles (T, K); drop and count rows without a value.

    Raises:
        InputError: too many angles, repeated names, times that do not increase, or fewer than two
            rows.

    """
    twice = sorted({name for name in names if list(names).count(name) > 1})
    if twice:
        raise InputError(f"{path}: joint {twice[0]} is there twice; names must differ")
    if joint_rad.size > MOST_CELLS:
        raise InputError(f"{path}: holds {joint_rad.size} angles; at most {MOST_CELLS} are read")
    whole = np.isfinite(joint_rad).all(axis=1) & np.isfinite(time_s)
    lines = list(notes)
    if not whole.all():
        lines.append(f"{int((~whole).sum())} of {len(whole)} rows lack a value and are left out")
    time_s = time_s[whole]
    joint_rad = joint_rad[whole]
    if len(time_s) < 2:
        raise InputError(f"{path}: {len(time_s)} whole rows of joint angles; a motion needs 2")
    step_s = np.diff(time_s)
    if not (step_s > 0.0).all():
        row = int(np.argmax(step_s <= 0.0)) + 1
        raise InputError(
            f"{path}: time must increase, in seconds; it does not after {time_s[row - 1]:g} s"
        )
    usual_s = float(np.median(step_s))
    missing = int(np.rint(step_s / usual_s - 1.0).clip(0).sum())
    if missing:
        lines.append(
            f"{missing} rows are missing in {int((step_s > 1.5 * usual_s).sum())} gaps of up to "
            f"{float(step_s.max()):.3g} s; the joints move evenly over them"
        )
    return JointMotion(time_s - time_s[0], tuple(names), joint_rad, tuple(lines))


def onto_robot(
    motion: JointMotion, robot: RobotConfig, asked: Mapping[str, str], where: str
) -> tuple[Floats, tuple[str, ...]]:
    """Return angles (T, J) in the order of a robot's joints, and lines about the mapping.

    ``asked`` has priority, then equal names. If no name is equal and the numbers of joints agree,
    joints are mapped in their order.

    Args:
        motion: from a file.
        robot: its joints move.
        asked: name in the file for a robot joint.
        where: name of the file in messages.

    Raises:
        InputError: a joint of the robot has no counterpart.

    """
    wanted = robot.joint_names
    found = motion.names
    for ours, theirs in asked.items():
        if ours not in wanted:
            raise InputError(f"--joint {ours}={theirs}: {robot.name} has {', '.join(wanted)}")
        if theirs not in (*found, REST):
            raise InputError(f"--joint {ours}={theirs}: {where} has {', '.join(found)}")
    pairs = {name: asked.get(name, name) for name in wanted}
    lost = [name for name, theirs in pairs.items() if theirs not in (*found, REST)]
    by_order = False
    if lost and not asked and len(lost) == len(wanted) == len(found):
        pairs = dict(zip(wanted, found, strict=True))
        lost = []
        by_order = True
    if lost:
        raise InputError(
            f"{where}: the file has no joint for {', '.join(lost)} of {robot.name}, but "
            f"{', '.join(found)}; add --joint {lost[0]}=NAME for each; {REST} as NAME keeps a "
            "joint at 0"
        )
    zeros = np.zeros(len(motion.time_s))
    columns = [
        zeros if theirs == REST else motion.joint_rad[:, found.index(theirs)]
        for theirs in (pairs[name] for name in wanted)
    ]
    listed = ", ".join(f"{ours} = {theirs}" for ours, theirs in pairs.items())
    lines = [f"joints {'by their order' if by_order else 'by name'}: {listed}"]
    unused = [name for name in found if name not in pairs.values()]
    if unused:
        moved = np.ptp(motion.joint_rad, axis=0) > _STILL_RAD
        moving = [name for name in unused if moved[found.index(name)]]
        lines.append(
            f"{len(unused)} joints of the file are not used, {len(moving)} of them move: "
            f"{', '.join(unused)}"
        )
    return np.stack(columns, axis=1), (*lines, *motion.notes)
