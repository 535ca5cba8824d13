"""BVH: a skeleton with offsets and joint rotations; forward kinematics gives keypoints.

In ``HIERARCHY`` each joint has an OFFSET from its parent and CHANNELS. Its rotation is the product
of its channels' rotations in their order, degrees. ``MOTION`` has the number of frames, the frame
time, and a row of channel values per frame. y is up. The unit of length is not stated, so the body
has no scale.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.archive import read_text
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.keypoints import Keypoints
from snakewalk.controller.track.readers.markers import number_or_none, projected

_MOST_JOINTS = 1000
_MOST_VALUES = 20_000_000
_AXES = "XYZ"
_TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def is_bvh(head: bytes) -> bool:
    """Whether a file with this head is a BVH."""
    return head.removeprefix(b"\xef\xbb\xbf").lstrip().upper().startswith(b"HIERARCHY")


@dataclass(slots=True)
class _Joint:
    name: str
    parent: int
    offset: Floats = field(default_factory=lambda: np.zeros(3))
    channels: list[str] = field(default_factory=list)


def load_bvh(file: Path, choice: Choice) -> Keypoints:
    """Load the joints as keypoints; see ``load.load_file``."""
    try:
        words = read_text(file).split()
    except UnicodeDecodeError:
        raise InputError(f"{file}: is not a BVH in UTF-8") from None
    upper = [word.upper() for word in words]
    if "MOTION" not in upper:
        raise InputError(f"{file}: has no MOTION; export it with its animation")
    begin = upper.index("MOTION")
    joints = _skeleton(file, words[1:begin])
    frames, step_s, values = _motion(file, words[begin + 1 :], sum(len(j.channels) for j in joints))
    places = _places(joints, values.reshape(frames, -1)) @ _TO_Z_UP.T
    longest = _longest_chain(joints)
    notes = []
    if choice.keypoints is None and len(longest) < len(joints):
        side_joints = [joints[k].name for k in range(len(joints)) if k not in longest]
        notes.append(
            f"{len(side_joints)} joints outside the longest chain are left out: "
            f"{', '.join(side_joints)}; --keypoints uses them"
        )
    kept = longest if choice.keypoints is None else list(range(len(joints)))
    notes.append(f"{joints[0].name} is taken as the head; --keypoints gives another order")
    names = [joints[k].name for k in kept]
    keypoints = projected(file, names, places[:, kept] + 1e-12, "m", 1.0 / step_s, choice, ups="+z")
    return replace(keypoints, scale_m=None, notes=(*notes, *keypoints.notes))


def _skeleton(file: Path, words: list[str]) -> list[_Joint]:
    joints: list[_Joint] = []
    above: list[int] = []
    index = 0
    try:
        while index < len(words):
            word = words[index].upper()
            if word in {"ROOT", "JOINT", "END"}:
                if word == "END":
                    joints.append(_Joint(f"{joints[above[-1]].name}_end", above[-1]))
                else:
                    joints.append(_Joint(words[index + 1], above[-1] if above else -1))
                index += 2
            elif word == "{":
                above.append(len(joints) - 1)
                index += 1
            elif word == "}":
                above.pop()
                index += 1
            elif word == "OFFSET":
                joints[above[-1]].offset = np.array(
                    [float(number) for number in words[index + 1 : index + 4]]
                )
                index += 4
            elif word == "CHANNELS":
                count = int(words[index + 1])
                joints[above[-1]].channels = [
                    channel_name.upper() for channel_name in words[index + 2 : index + 2 + count]
                ]
                index += 2 + count
            else:
                raise InputError(f"{file}: unknown word {words[index][:20]!r} in its HIERARCHY")
    except (IndexError, ValueError):
        raise InputError(f"{file}: its HIERARCHY is damaged near word {index + 1}") from None
    if not joints or above:
        raise InputError(f"{file}: its HIERARCHY is cut")
    _check_joints(file, joints)
    return joints


def _check_joints(file: Path, joints: list[_Joint]) -> None:
    if [joint.parent for joint in joints].count(-1) > 1:
        raise InputError(f"{file}: has two skeletons; export one")
    if len(joints) > _MOST_JOINTS:
        raise InputError(f"{file}: has more than {_MOST_JOINTS} joints")
    channels = {f"{axis}{kind}" for axis in _AXES for kind in ("POSITION", "ROTATION")}
    unknown_channels = [
        channel for joint in joints for channel in joint.channels if channel not in channels
    ]
    if unknown_channels:
        raise InputError(f"{file}: its HIERARCHY has a channel {unknown_channels[0]}")


def _motion(file: Path, words: list[str], channels: int) -> tuple[int, float, Floats]:
    """Number of frames, frame time, and all channel values."""
    text = [word.rstrip(":").upper() for word in words[:5]]
    stated = [number_or_none(word) for word in words[1:5]]
    frames = stated[0] if stated else None
    step_s = stated[3] if len(stated) > 3 else None
    if text[:1] != ["FRAMES"] or frames is None or step_s is None or not step_s > 0.0:
        raise InputError(f"{file}: expected Frames: N and Frame Time: S above 0 after MOTION")
    rows = words[5:]
    if channels * frames > _MOST_VALUES:
        raise InputError(f"{file}: states {frames:g} frames of {channels} channels; give a part")
    if len(rows) != frames * channels or frames < 2:
        raise InputError(
            f"{file}: states {frames:g} frames of {channels} channels and has {len(rows)} values; "
            "export it again"
        )
    try:
        return int(frames), step_s, np.array(rows, dtype=float)
    except ValueError as error:
        raise InputError(f"{file}: in its MOTION: {error}") from None


def _places(joints: list[_Joint], values: Floats) -> Floats:
    """(T, K, 3) places of the joints for channel values (T, C)."""
    frames = len(values)
    column = 0
    turns = np.empty((len(joints), frames, 3, 3))
    places = np.empty((frames, len(joints), 3))
    for k, joint in enumerate(joints):
        turn = np.tile(np.eye(3), (frames, 1, 1))
        shift = np.tile(joint.offset, (frames, 1))
        moved = np.zeros((frames, 3))
        for channel in joint.channels:
            if channel.endswith("POSITION"):
                moved[:, _AXES.index(channel[0])] = values[:, column]
            else:
                angles = values[:, column, None]
                turn = (
                    turn @ Rotation.from_euler(channel[0].lower(), angles, degrees=True).as_matrix()
                )
            column += 1
        if joint.parent < 0:
            turns[k], places[:, k] = turn, shift + moved
        else:
            above = turns[joint.parent]
            turns[k] = above @ turn
            offset = (above @ (shift + moved)[:, :, None])[:, :, 0]
            places[:, k] = places[:, joint.parent] + offset
    return places


def _longest_chain(joints: list[_Joint]) -> list[int]:
    depth = [0] * len(joints)
    for k, joint in enumerate(joints):
        depth[k] = depth[joint.parent] + 1 if joint.parent >= 0 else 0
    chain = [int(np.argmax(depth))]
    while joints[chain[-1]].parent >= 0:
        chain.append(joints[chain[-1]].parent)
    return chain[::-1]
