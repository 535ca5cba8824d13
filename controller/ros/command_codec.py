"""Commands between the process of the ROS node and the run: a line of JSON each.

The thousands of points of a trajectory are packed: the run unpacks 500 points of sixteen joints in
less than a millisecond.
"""

import base64
import json
import math
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from snakewalk.config.archive import parse_json
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.motion.command import (
    LINE_BYTES,
    Command,
    GoTo,
    HoldStill,
    JointGoals,
    JointTrajectory,
    Refused,
    StartGait,
    Velocity,
)

LATE_S = 0.5
"""A command that waited longer for the run is rejected (ours): nothing stale moves a joint."""
_MOST_AHEAD_S = 0.1
"""A command with a later time is rejected (ours): both processes read the same clock."""
_NAMES = {
    "goals": "joint goals",
    "trajectory": "trajectory",
    "gait": "gait",
    "velocity": "velocity",
    "goto": "goal pose",
}


def encode_command(command: Command) -> str:
    """Return a command as a line, with the current time of the machine's clock.

    A command that is longer than the run accepts becomes a ``Refused``.
    """
    row: dict[str, Any]
    if isinstance(command, JointGoals):
        positions = [float(value) for value in command.position_rad]
        row = {"kind": "goals", "joints": list(command.joints), "position_rad": positions}
    elif isinstance(command, JointTrajectory):
        row = {"kind": "trajectory", "joints": list(command.joints)}
        row |= {
            key: _packed_array(value) for key, value in command._asdict().items() if key != "joints"
        }
    elif isinstance(command, StartGait):
        gait = command.gait
        row = {"kind": "gait", "name": gait.name, "parameters": gait.params.model_dump()}
    elif isinstance(command, Velocity):
        row = {"kind": "velocity", "velocity": list(command)}
    elif isinstance(command, GoTo):
        row = {"kind": "goto", "point_m": list(command)}
    elif isinstance(command, Refused):
        row = {"kind": "refused", "why": command.why}
    else:
        row = {"kind": "hold"}
    line = json.dumps(row | {"sent_s": time.monotonic()})
    if len(line) <= LINE_BYTES:
        return line
    what = _NAMES.get(row["kind"], "command")
    why = f"{what}: {len(line) / 1e6:.1f} MB; at most {LINE_BYTES / 1e6:.1f} MB is accepted"
    return encode_command(Refused(why))


def decode_command(
    line: str, now_s: Callable[[], float] = time.monotonic, late_s: float = LATE_S
) -> Command:
    """Return the command of a line; it is ``Refused`` if it comes too late.

    Raises:
        InputError: the line is damaged, or a gait's parameters are out of range.

    """
    try:
        row = parse_json(line)
        kind = row["kind"]
        age_s = now_s() - float(row["sent_s"])
        if kind in _NAMES:
            if not age_s >= -_MOST_AHEAD_S:  # NaN, too
                return Refused(f"{kind}: its time is {-age_s:.1f} s ahead of this machine's clock")
            if age_s > late_s:
                return Refused(f"{kind}: waited {age_s:.1f} s for the run")
        return _command(kind, row)
    except (ValueError, TypeError, KeyError, ArithmeticError, AttributeError):
        raise InputError("a damaged command; restart the program that sends it") from None


def _command(kind: str, row: dict[str, Any]) -> Command:
    """Return the command of a row.

    Raises:
        InputError: a gait's parameters are out of range.
        ValueError, TypeError, KeyError, ArithmeticError, AttributeError: the row is damaged.

    """
    if kind == "goals":
        return JointGoals(_texts(row["joints"]), [float(value) for value in row["position_rad"]])
    if kind == "trajectory":
        time_s = _unpacked_array(row["time_s"], 1)
        position_rad = _unpacked_array(row["position_rad"], 2)
        if time_s is None or position_rad is None:
            raise ValueError("a trajectory needs times and positions")
        return JointTrajectory(
            _texts(row["joints"]),
            time_s,
            position_rad,
            _unpacked_array(row["velocity_rad_s"], 2),
            _unpacked_array(row["acceleration_rad_s2"], 2),
        )
    if kind == "gait":
        from snakewalk.controller.gaits.registry import make_gait  # noqa: PLC0415  the node has none

        return StartGait(make_gait(row["name"], row["parameters"]))
    if kind == "velocity":
        forward_m_s, turn_rad_s = (float(value) for value in row["velocity"])
        return Velocity(forward_m_s, turn_rad_s)
    if kind == "goto":
        x_m, y_m = (float(value) for value in row["point_m"])
        return GoTo(x_m, y_m)
    if kind == "refused":
        return Refused(str(row["why"]))
    if kind == "hold":
        return HoldStill()
    raise ValueError("an unknown kind")


def _texts(values: Sequence[Any]) -> list[str]:
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise TypeError("a list of names is expected")
    return values


def _packed_array(values: Floats | None) -> list[Any] | None:
    """Shape and base64 of float64."""
    if values is None:
        return None
    array = np.ascontiguousarray(values, dtype="<f8")
    return [array.shape, base64.b64encode(array.tobytes()).decode()]


def _unpacked_array(row: list[Any] | None, dimensions: int) -> Floats | None:
    if row is None:
        return None
    shape, text = row
    array = np.frombuffer(base64.b64decode(text), dtype="<f8")
    if len(shape) != dimensions or math.prod(shape) != array.size:
        raise ValueError("the shape does not match the values")
    return array.reshape(shape)
