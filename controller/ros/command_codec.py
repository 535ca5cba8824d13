"""Commands between the ROS node's process and the run's: a line of JSON each.

The points of a trajectory are thousands of numbers, so they are packed: the run, which has a
cycle to keep, unpacks 500 points of sixteen joints in less than a millisecond.
"""

import base64
import json
import math
import time
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.motion.command import (
    Command,
    HoldStill,
    JointGoals,
    JointTrajectory,
    Refused,
    StartGait,
)

LATE_S: Final = 0.5
"""A command that waited longer for the run is refused (ours): nothing stale moves a joint."""


def encode_command(command: Command) -> str:
    """Return a command as a line, with the time now on the clock of the machine."""
    row: dict[str, Any]
    if isinstance(command, JointGoals):
        positions = [float(value) for value in command.position_rad]
        row = {"kind": "goals", "joints": list(command.joints), "position_rad": positions}
    elif isinstance(command, JointTrajectory):
        row = {"kind": "trajectory", "joints": list(command.joints)}
        row |= {key: _packed(value) for key, value in command._asdict().items() if key != "joints"}
    elif isinstance(command, StartGait):
        gait = command.gait
        row = {"kind": "gait", "name": gait.name, "parameters": gait.params.model_dump()}
    elif isinstance(command, Refused):
        row = {"kind": "refused", "why": command.why}
    else:
        row = {"kind": "hold"}
    return json.dumps(row | {"sent_s": time.monotonic()})


def decode_command(
    line: str, now_s: Callable[[], float] = time.monotonic, late_s: float = LATE_S
) -> Command:
    """Return the command of a line; it is ``Refused`` where it comes too late.

    Raises:
        InputError: a gait's parameters are out of range.

    """
    row = json.loads(line)
    kind, age_s = row["kind"], now_s() - row["sent_s"]
    if kind in ("goals", "trajectory", "gait") and age_s > late_s:
        return Refused(f"{kind}: waited {age_s:.1f} s for the run")
    if kind == "goals":
        return JointGoals(row["joints"], row["position_rad"])
    if kind == "trajectory":
        return JointTrajectory(
            row["joints"],
            *(_unpacked(row[key]) for key in JointTrajectory._fields[1:]),  # type: ignore[arg-type]
        )
    if kind == "gait":
        from snakewalk.controller.gaits.registry import make_gait  # noqa: PLC0415  the node has none

        return StartGait(make_gait(row["name"], row["parameters"]))
    return Refused(row["why"]) if kind == "refused" else HoldStill()


def _packed(values: Floats | None) -> list[Any] | None:
    """Shape and base64 of float64."""
    if values is None:
        return None
    array = np.ascontiguousarray(values, dtype="<f8")
    return [array.shape, base64.b64encode(array.tobytes()).decode()]


def _unpacked(row: list[Any] | None) -> Floats | None:
    if row is None:
        return None
    shape, text = row
    array = np.frombuffer(base64.b64decode(text), dtype="<f8")
    return array.reshape(shape) if math.prod(shape) == array.size else np.zeros((0, 0))
