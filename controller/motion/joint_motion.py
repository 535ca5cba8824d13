"""Joint angles over time from another program's file, and their mapping to a robot's joints.

A reader is a plug-in of the kind ``joints`` (``docs/how-to/add-a-plug-in.md``).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.file_units import ANGLES_RAD, DEGREE, TIMES_S
from snakewalk.config.playback import JointRequest
from snakewalk.config.reading import Fact, Facts, decided
from snakewalk.config.robot import RobotConfig

MOST_CELLS = 20_000_000
"""Angles of a motion (ours): an hour of 50 joints at 100 Hz."""
REST = "rest"
"""Name that keeps a joint of the robot at 0."""
_STILL_JOINT_RAD = 1e-6
_MOST_RAD = 2.0 * np.pi
"""Largest angle of a joint that may be in radians (ours)."""
_NUMBERED_NAME = re.compile(r"^(.*?)(\d+)(?:[_.]?(?:pos|position|joint))?$", re.IGNORECASE)
"""Name of a joint with a number near its end."""
_STEPS_S = (0.0005, 0.5)
"""Steps between rows of a motion, s (ours)."""


@dataclass(frozen=True, slots=True)
class JointMotion:
    """Named joint angles over time."""

    time_s: Floats
    """(T,) increasing."""
    names: tuple[str, ...]
    """Names of the K joints of the file."""
    joint_rad: Floats
    """(T, K) joint angles, rad; NaN where a value is missing."""
    facts: Facts
    """Quantity, unit, order and time base of the values."""
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


def radians(where: str, angles: Floats, unit: Fact | None, hint: str) -> tuple[Floats, Fact]:
    """Return angles in radians, and the fact of their unit in the file.

    Raises:
        InputError: neither the file nor the user states their unit.

    """
    largest = float(np.nanmax(np.abs(angles), initial=0.0))
    readings = {} if largest > _MOST_RAD else {"rad": f"up to {np.degrees(largest):.3g}°"}
    readings[DEGREE] = f"up to {largest:.3g}°"
    question = f"states no unit of angles, which go to {largest:.3g}; {hint}"
    unit = decided(where, question, "--unit", readings, unit)
    return angles * ANGLES_RAD[unit.value], unit


def time_unit(path: Path, time: Floats, column: str, unit: Fact | None) -> Fact:
    """Return the unit of times (T,), one of ``TIMES_S``, which may not be stated.

    Seconds are assumed if no other unit gives steps that a recording of motion has.

    Raises:
        InputError: another unit is possible.

    """
    if unit is not None:
        return unit
    finite = time[np.isfinite(time)]
    steps = np.diff(finite)
    step = float(np.median(steps)) if len(steps) else 0.01
    least_s, most_s = _STEPS_S
    possible = [unit for unit, size in TIMES_S.items() if least_s <= step * size <= most_s]
    if possible in ([], ["s"]):
        return Fact("s", "inferred", "no other unit is possible")
    length = np.ptp(finite)
    readings = {
        unit: f"{length * size:.4g} s at {1.0 / (step * size):.4g} Hz"
        for unit, size in TIMES_S.items()
        if unit in {"s", *possible}
    }
    question = f"column {column} states no unit of time"
    return decided(path, question, "--time-unit", readings, None)


def joint_motion(
    path: Path,
    time_s: Floats,
    names: Sequence[str],
    joint_rad: Floats,
    notes: Sequence[str] = (),
    *,
    unit: Fact,
    time: Fact,
) -> JointMotion:
    """Check angles (T, K) of a reader; NaN is a missing value. ``unit`` and ``time`` are facts.

    Raises:
        InputError: too many angles, repeated names, or times that do not increase.

    """
    twice = sorted({name for name in names if list(names).count(name) > 1})
    if twice:
        raise InputError(f"{path}: joint {twice[0]} is there twice; names must differ")
    if joint_rad.size > MOST_CELLS:
        raise InputError(f"{path}: holds {joint_rad.size} angles; at most {MOST_CELLS} are read")
    has_time = np.isfinite(time_s)
    step_s = np.diff(time_s[has_time])
    if not (step_s > 0.0).all():
        last_s = time_s[has_time][int(np.argmax(step_s <= 0.0))]
        raise InputError(f"{path}: time must increase, in seconds; it does not after {last_s:g} s")
    facts: Facts = {
        "quantity": Fact("joint angles", "file", "its format"),
        "unit": unit,
        "order": Fact("by names", "file", ", ".join(names)),
        "time": time,
    }
    return JointMotion(time_s, tuple(names), joint_rad, facts, tuple(notes))


def _complete(motion: JointMotion, joint_rad: Floats, where: str) -> JointMotion:
    """Return a motion of angles (T, J) from 0 s; drop and count rows without a value.

    Raises:
        InputError: fewer than two rows are left.

    """
    is_complete = np.isfinite(joint_rad).all(axis=1) & np.isfinite(motion.time_s)
    lines = list(motion.notes)
    if not is_complete.all():
        lines.append(
            f"{int((~is_complete).sum())} of {len(is_complete)} rows lack a value and are left out"
        )
    time_s = motion.time_s[is_complete]
    if len(time_s) < 2:
        raise InputError(f"{where}: {len(time_s)} complete rows of joint angles; a motion needs 2")
    step_s = np.diff(time_s)
    usual_s = float(np.median(step_s))
    missing = int(np.rint(step_s / usual_s - 1.0).clip(0).sum())
    if missing:
        lines.append(
            f"{missing} rows are missing in {int((step_s > 1.5 * usual_s).sum())} gaps of up to "
            f"{step_s.max():.3g} s"
        )
    return replace(
        motion,
        time_s=time_s - time_s[0],
        joint_rad=joint_rad[is_complete],
        notes=tuple(lines),
    )


def _by_stem(names: Sequence[str]) -> dict[str, list[str]]:
    """Return names by their letters before the number, in the order of the numbers.

    Names of which one has no number have no stems: the result is empty.
    """
    parts = [(_NUMBERED_NAME.match(name), name) for name in names]
    if any(part is None for part, _ in parts):
        return {}
    numbered = sorted((int(part[2]), part[1], name) for part, name in parts if part is not None)
    stems = dict.fromkeys(stem for _, stem, _ in numbered)
    return {s: [name for _, stem, name in numbered if stem == s] for s in stems}


def _by_number(names: Sequence[str], joint_names: Sequence[str], where: str) -> dict[str, str]:
    """Return the name in the file of each joint of a robot, both numbered from the head.

    Raises:
        InputError: the names have several stems, which are not those of the robot's joints; shows
            a mapping.

    """
    by_file_stem, by_joint_stem = _by_stem(names), _by_stem(joint_names)
    if len(by_file_stem) == 1:
        return dict(zip(joint_names, *by_file_stem.values(), strict=True))
    pairs = {
        joint: name
        for stem, joints in by_joint_stem.items()
        for other, file_names in by_file_stem.items()
        if len(joints) == len(file_names) and _words(stem) & _words(other)
        for joint, name in zip(joints, file_names, strict=True)
    }
    if len(by_file_stem) == len(by_joint_stem) and sorted(pairs.values()) == sorted(names):
        return pairs
    options = " ".join(
        f"--joint {joint_name}={file_name}"
        for joint_name, file_name in zip(joint_names, names, strict=True)
    )
    raise InputError(
        f"{where}: the names of its joints do not state their order on the body; in the order of "
        f"the file: {options}; add these options, after you have corrected them"
    )


def _words(stem: str) -> set[str]:
    return set(re.findall("[a-z]+", stem.lower()))


def onto_robot(
    motion: JointMotion, robot: RobotConfig, asked: Mapping[str, str], where: str
) -> JointMotion:
    """Return a motion with the joint of the file, or ``rest``, for each joint of a robot.

    ``asked`` has priority, then equal names. If no name is equal and the numbers of joints agree,
    joints are mapped by the numbers in their names, within stems such as ``yaw`` and ``pitch``.

    Args:
        motion: from a file.
        robot: its joints move.
        asked: name in the file for a robot joint.
        where: name of the file in messages.

    Raises:
        InputError: a joint of the robot has no counterpart, the names do not state their order on
            the body, or fewer than two rows have all values.

    """
    joint_names = robot.joint_names
    names = motion.names
    for joint_name, file_name in asked.items():
        if joint_name not in joint_names:
            raise InputError(
                f"--joint {joint_name}={file_name}: {robot.name} has {', '.join(joint_names)}"
            )
        if file_name not in (*names, REST):
            raise InputError(f"--joint {joint_name}={file_name}: {where} has {', '.join(names)}")
    pairs = {name: asked.get(name, name) for name in joint_names}
    lost = [name for name, file_name in pairs.items() if file_name not in (*names, REST)]
    source = "name"
    if lost and not asked and len(lost) == len(joint_names) == len(names):
        pairs = _by_number(names, joint_names, where)
        source = "number"
        lost = []
    if lost:
        raise InputError(
            f"{where}: the file has no joint for {', '.join(lost)} of {robot.name}, but "
            f"{', '.join(names)}; add --joint {lost[0]}=NAME for each; {REST} as NAME keeps a "
            "joint at 0"
        )
    zeros = np.zeros(len(motion.time_s))
    columns = [
        zeros if file_name == REST else motion.joint_rad[:, names.index(file_name)]
        for file_name in (pairs[name] for name in joint_names)
    ]
    listed = ", ".join(f"{joint_name} = {file_name}" for joint_name, file_name in pairs.items())
    lines = [f"joints by {source}: {listed}"]
    unused = [name for name in names if name not in pairs.values()]
    if unused:
        highest, lowest = (pick.reduce(motion.joint_rad) for pick in (np.fmax, np.fmin))
        moved = highest - lowest > _STILL_JOINT_RAD
        moving = [name for name in unused if moved[names.index(name)]]
        lines.append(
            f"{len(unused)} joints of the file are not used, {len(moving)} of them move: "
            f"{', '.join(unused)}"
        )
    complete = _complete(motion, np.stack(columns, axis=1), where)
    names = tuple(pairs[name] for name in joint_names)
    return replace(complete, names=names, notes=(*lines, *complete.notes))
