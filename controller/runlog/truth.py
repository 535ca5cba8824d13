"""Truth of a served robot: one JSON object per line, written by the server alone.

The first line describes robot and world. Each other line is a measured pose: its number, its time
on the servos' clock, the arrival of its datagram (null: never), and the place of the body.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from snakewalk.config.archive import parse_json, read_text
from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.runlog.record import MotorEnergy

FORMAT = 1


class TruthLog:
    """Writes the truth; use it in a ``with``."""

    def __init__(self, path: Path, header: Mapping[str, Any]) -> None:
        self._file = path.open("w", encoding="utf-8")
        self._write({"snakewalk_truth": FORMAT, **header})

    def add(
        self,
        sequence: int,
        time_s: float,
        sent_s: float | None,
        head_m: Floats,
        rotation: Floats,
        centre_m: Floats,
        energy: MotorEnergy,
    ) -> None:
        """Write where the body was when a pose was measured, and the energy of its motors."""
        self._write(
            {
                "sequence": sequence,
                "time_s": round(time_s, 6),
                "sent_s": None if sent_s is None else round(sent_s, 6),
                "head_m": [round(float(value), 6) for value in head_m],
                "rotation": [round(float(value), 7) for value in rotation.ravel()],
                "centre_m": [round(float(value), 6) for value in centre_m],
                "energy_j": [round(value, 4) for value in energy],
            }
        )

    def _write(self, row: Mapping[str, Any]) -> None:
        self._file.write(json.dumps(row, separators=(",", ":")) + "\n")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self._file.close()


@dataclass(frozen=True, slots=True)
class Truth:
    """The truth of a served robot, read back; one entry for each pose that was measured."""

    header: dict[str, Any]
    sequence: Ints
    """(n,) numbers of the poses."""
    time_s: Floats
    """(n,) on the clock of the servos."""
    sent_s: Floats
    """(n,) when the pose arrived; NaN where it did not."""
    head_m: Floats
    """(n, 3) centre of the head link."""
    rotation: Floats
    """(n, 3, 3) axes of the head link, in columns."""
    centre_m: Floats
    """(n, 3) centre of mass."""
    energy_j: Floats
    """(n, 2) ``MotorEnergy`` since the start, integrated; NaN if the file lacks it."""


def read_truth(path: Path) -> Truth:
    """Read the truth of a served robot; a last line that is cut off is left out.

    Raises:
        InputError: the file is missing, or contains no truth.

    """
    try:
        lines = read_text(path).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from None
    rows = []
    for number, line in enumerate(lines):
        try:
            rows.append(parse_json(line))
        except ValueError:
            if number < len(lines) - 1:
                raise InputError(f"{path}: line {number + 1} is damaged") from None
    if not rows or not isinstance(rows[0], dict) or rows[0].get("snakewalk_truth") != FORMAT:
        raise InputError(
            f"{path}: contains no truth of a served robot; give the file of bus serve --truth"
        )
    header = rows[0]
    poses = rows[1:]
    if not poses:
        raise InputError(f"{path}: the served robot was never measured")
    try:
        return Truth(
            header,
            np.array([row["sequence"] for row in poses], np.int64),
            np.array([row["time_s"] for row in poses], float),
            np.array([np.nan if row["sent_s"] is None else row["sent_s"] for row in poses], float),
            np.array([row["head_m"] for row in poses], float).reshape(-1, 3),
            np.array([row["rotation"] for row in poses], float).reshape(-1, 3, 3),
            np.array([row["centre_m"] for row in poses], float).reshape(-1, 3),
            np.array([row.get("energy_j", [np.nan, np.nan]) for row in poses], float),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: is damaged ({type(error).__name__}: {error})") from None
