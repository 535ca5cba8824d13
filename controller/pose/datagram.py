"""The datagram of an external pose: one JSON object (docs/how-to/external-pose.md)."""

import json
import math
from typing import Any

import numpy as np

from snakewalk.config.archive import parse_json
from snakewalk.controller.pose.sample import (
    PoseSample,
    UnusablePoseError,
    quaternion_of,
    rotation_of,
)

VERSION = 1
MOST_BYTES = 4096
"""Largest datagram that is read (ours)."""
_KEYS = {"sequence", "time_s", "frame", "position_m", "quaternion_wxyz"}
_SYMMETRY = 1e-6


def encode_pose(sample: PoseSample) -> bytes:
    """Return a pose as a datagram."""
    row: dict[str, Any] = {
        "snakewalk_pose": VERSION,
        "sequence": sample.sequence,
        "time_s": sample.time_s,
        "frame": sample.frame,
        "position_m": [float(value) for value in sample.position_m],
        "quaternion_wxyz": list(quaternion_of(sample.rotation)),
    }
    if sample.covariance is not None:
        row["covariance"] = [float(value) for value in np.ravel(sample.covariance)]
    return json.dumps(row, separators=(",", ":")).encode()


def decode_pose(data: bytes) -> PoseSample:
    """Return the pose of a datagram.

    Raises:
        UnusablePoseError: it is not of this format or version, or contains a number that cannot be.

    """
    try:
        row = parse_json(data.decode())
    except ValueError:
        raise UnusablePoseError("not a JSON object; send one JSON object per datagram") from None
    if not isinstance(row, dict) or "snakewalk_pose" not in row:
        raise UnusablePoseError(
            "no key snakewalk_pose; send the format of docs/how-to/external-pose.md"
        )
    if row["snakewalk_pose"] != VERSION:
        raise UnusablePoseError(
            f"version {row['snakewalk_pose']!r}; this program reads version {VERSION}"
        )
    missing = sorted(_KEYS - set(row))
    if missing:
        raise UnusablePoseError(f"{', '.join(missing)}: missing; every pose needs these keys")
    sequence = row["sequence"]
    frame = row["frame"]
    if not isinstance(sequence, int) or isinstance(sequence, bool) or sequence < 0:
        raise UnusablePoseError(f"sequence {sequence!r}: must be a whole number from 0 on")
    if not isinstance(frame, str) or len(frame) > 100:
        raise UnusablePoseError("frame: must be a name")
    covariance = row.get("covariance")
    return PoseSample(
        sequence,
        _numbers("time_s", [row["time_s"]], 1)[0],
        np.array(_numbers("position_m", row["position_m"], 3)),
        rotation_of(_numbers("quaternion_wxyz", row["quaternion_wxyz"], 4)),
        frame,
        None if covariance is None else checked_covariance(_numbers("covariance", covariance, 36)),
    )


def checked_covariance(values: list[float]) -> np.ndarray:
    """Return the covariance (6, 6) of 36 numbers.

    Raises:
        UnusablePoseError: it is not symmetric, or a variance is negative.

    """
    matrix = np.array(values).reshape(6, 6)
    if np.abs(matrix - matrix.T).max() > _SYMMETRY * max(float(np.abs(matrix).max()), 1e-12):
        raise UnusablePoseError("covariance: must be symmetric, 6 rows of 6 numbers")
    if (matrix.diagonal() < 0.0).any():
        raise UnusablePoseError("covariance: a variance is negative")
    return matrix


def _numbers(key: str, values: Any, count: int) -> list[float]:
    """Return finite numbers.

    Raises:
        UnusablePoseError: there are not ``count`` of them, or one is not finite.

    """
    if (
        not isinstance(values, list)
        or len(values) != count
        or any(isinstance(v, bool) or not isinstance(v, int | float | None) for v in values)
    ):
        raise UnusablePoseError(f"{key}: must be {count} numbers")
    try:
        numbers = [math.nan if value is None else float(value) for value in values]
    except OverflowError:
        numbers = [math.inf]
    if not all(map(math.isfinite, numbers)):
        raise UnusablePoseError(f"{key}: not finite (NaN); the tracker has lost the body")
    return numbers
