"""Truth of a served robot: one JSON object per line, written by the server alone.

The first line describes robot and world. Each other line is a measured pose: its number, its time
on the servos' clock, the arrival of its datagram (null: never), and the place of the body.
"""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, Self

import numpy as np

from snakewalk.config.archive import parse_json
from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.runlog.column import ROWS, StoredColumn, storage_folder
from snakewalk.controller.runlog.record import MotorEnergy

FORMAT = 1
_LINE_MAX = 1_000_000
_NUMBERS = 20
"""Numbers of a line."""


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
    header: dict[str, Any] = {}
    lines = _lines(path, header)
    folder = storage_folder(path)
    columns = [StoredColumn(folder, part) for part in _fields(np.empty((0, _NUMBERS)))]
    while some := list(islice(lines, ROWS)):
        for column, part in zip(columns, _fields(np.array(some)), strict=True):
            column.append(part)
    if not header:
        raise InputError(
            f"{path}: contains no truth of a served robot; give the file of bus serve --truth"
        )
    truth = Truth(header, *(column.mapped() for column in columns))
    if not len(truth.time_s):
        raise InputError(
            f"{path}: contains no true pose; let bus serve run until the robot has moved"
        )
    return truth


def _fields(rows: Floats) -> list[Floats | Ints]:
    """Fields of ``Truth`` after its header, in their order."""
    return [
        rows[:, 0].astype(np.int64),
        rows[:, 1],
        rows[:, 2],
        rows[:, 3:6],
        rows[:, 6:15].reshape(-1, 3, 3),
        rows[:, 15:18],
        rows[:, 18:],
    ]


def _lines(path: Path, header: dict[str, Any]) -> Iterator[list[float]]:
    """Fill the header from the first line, and yield the numbers of each other line."""
    damaged = 0
    try:
        with path.open(encoding="utf-8-sig") as file:
            for count, line in enumerate(iter(partial(file.readline, _LINE_MAX), ""), start=1):
                if damaged:
                    raise InputError(f"{path}: line {damaged} is damaged")
                try:
                    row = parse_json(line)
                except ValueError:
                    damaged = count
                    continue
                if count > 1:
                    yield _numbers(row)
                elif isinstance(row, dict) and row.get("snakewalk_truth") == FORMAT:
                    header.update(row)
                else:
                    break
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from None
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: is damaged ({type(error).__name__}: {error})") from None


def _numbers(row: Mapping[str, Any]) -> list[float]:
    """Numbers of a line; NaN if unknown."""
    cells = [row["sequence"], row["time_s"], row["sent_s"]]
    for name in ("head_m", "rotation", "centre_m"):
        cells += row[name]
    cells += row.get("energy_j", (None, None))
    if len(cells) != _NUMBERS:
        raise ValueError(f"{len(cells)} numbers instead of {_NUMBERS}")
    return [math.nan if cell is None else float(cell) for cell in cells]
