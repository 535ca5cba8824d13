"""The actions of one robot on one ground, and their file."""

import json
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from snakewalk.config.archive import parse_json, read_arrays
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.repertoire.segment import REVERSE, SIDES, Segment

FORMAT = "snakewalk-repertoire-1"
_HEAD = ("robot", "joint_axes", "world", "length_m", "law", "swims")
NO_LAW = "not stated"
"""Text for files without the law of friction."""
_ARRAYS = ("turn", "move_m", "link_m", "link_rotation", "goal_rad", "joint_rad")
_PLAIN_FIELDS = tuple(f.name for f in fields(Segment) if f.name not in _ARRAYS)


@dataclass(frozen=True, slots=True)
class Repertoire:
    """Segments with one frame time and one number of links."""

    robot: str
    joint_axes: str
    """Axes of the recorded robot's joints, as in its configuration."""
    world: str
    length_m: float
    """Length of the recorded body: another body is scaled by the ratio of lengths."""
    segments: tuple[Segment, ...]
    law: str = NO_LAW
    """Law of friction of the recorded runs."""
    swims: bool = False
    """Whether the actions were recorded in water."""

    @property
    def frame_s(self) -> float:
        """Time of a frame."""
        return self.segments[0].frame_s

    def index(self, name: str) -> int:
        """Return the place of the segment ``name``.

        Raises:
            InputError: the segment does not exist.

        """
        names = [segment.name for segment in self.segments]
        if name not in names:
            raise InputError(f"{name}: no such action; there are {', '.join(names)}")
        return names.index(name)

    def contradictions(self) -> list[str]:
        """Return a line for each action that was not carried out in the direction of its kind."""
        lines = []
        for segment in self.segments:
            speed_m_s = segment.speed_m_s
            turn_rad_s = segment.turn_rad_s
            forward = {"brake": 0, "rest": 0}.get(segment.kind, 1)
            forward = -1 if segment.kind in REVERSE else forward
            left = SIDES.get(segment.kind, 0)
            if forward * speed_m_s < 0.0 or left * turn_rad_s < 0.0:
                lines.append(
                    f"action {segment.name}: the body went {speed_m_s:.2f} m/s and turned "
                    f"{turn_rad_s:.2f} rad/s (positive: forward, left); "
                    f"world {self.world} does not carry this action"
                )
        return lines

    def check(self, robot: RobotConfig) -> None:
        """Refuse a robot with other joints.

        Raises:
            InputError: one line.

        """
        if self.joint_axes != robot.joint_axes:
            raise InputError(
                f"repertoire of {self.robot}: joints {self.joint_axes}; "
                f"robot {robot.name} has {robot.joint_axes}"
            )

    def save(self, path: Path) -> None:
        """Write an NPZ file: arrays by ``number/name``, the rest as JSON under ``about``."""
        about = {
            "format": FORMAT,
            **{key: getattr(self, key) for key in _HEAD},
            "segments": [{key: getattr(s, key) for key in _PLAIN_FIELDS} for s in self.segments],
        }
        arrays = {
            f"{k}/{name}": getattr(segment, name)
            for k, segment in enumerate(self.segments)
            for name in _ARRAYS
        }
        with path.open("wb") as file:
            np.savez_compressed(file, about=np.array(json.dumps(about)), **arrays)


def load_repertoire(path: Path) -> Repertoire:
    """Read what ``Repertoire.save`` wrote.

    Raises:
        InputError: no such file, or none of ours.

    """
    if not path.is_file():
        raise InputError(
            f"{path}: no such file; make one by: snakewalk gait repertoire record -o {path}"
        )
    try:
        arrays, _ = read_arrays(path)
        about = parse_json(str(arrays["about"]))
        if about.get("format") != FORMAT:
            raise InputError(f"{path}: format {about.get('format')}; expected {FORMAT}")
        about = {"law": NO_LAW, "swims": False} | about
        about = {key: about[key] for key in (*_HEAD, "segments")}
        segments = tuple(
            Segment(**plain, **{name: arrays[f"{k}/{name}"] for name in _ARRAYS})
            for k, plain in enumerate(about["segments"])
        )
    except (KeyError, TypeError, AttributeError, ValueError):
        raise InputError(
            f"{path}: not a repertoire; snakewalk gait repertoire record makes one"
        ) from None
    if not segments:
        raise InputError(f"{path}: a repertoire without actions")
    return Repertoire(**{key: about[key] for key in _HEAD}, segments=segments)
