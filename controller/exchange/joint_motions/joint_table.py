"""Joint angles as a CSV: a column of time, then a column for each joint."""

import re
from pathlib import Path
from typing import Final

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.text_table import numbers_of, read_rows
from snakewalk.controller.console.command import plugin
from snakewalk.controller.motion.joint_motion import (
    JointMotion,
    JointRequest,
    joint_motion,
    radians,
    second,
)

_TIME: Final = re.compile("(?:time|t|timestamp)(?:_(s|ms|us|ns))?|(s)econds")
"""Name of the column of time, and the unit that it states."""
_MIDLINE_COLUMNS: Final = {"frame", "point", "frame_idx", "scorer"}
_UNIT: Final = re.compile(r"^(.*?)[ _.]?[\[(]?(rad|deg|radians|degrees)[\])]?$", re.IGNORECASE)


@plugin("joints", "csv")
class JointTable:
    """A CSV with the columns time and one for each joint."""

    def accepts(self, path: Path, head: bytes) -> bool:
        """Whether the first line names a time and then joints."""
        try:
            line = head.decode("utf-8-sig", "strict" if len(head) < 4 else "ignore").splitlines()[0]
        except (UnicodeDecodeError, IndexError):
            return False
        cells = re.split(r"[,;\t]", line)
        names = [_plain_name(cell.strip(' "')) for cell in cells]
        is_time = _TIME.fullmatch(names[0]) is not None
        return (
            len(cells) > 1 and is_time and not {*names} & _MIDLINE_COLUMNS and b"\x00" not in head
        )

    def read(self, path: Path, request: JointRequest) -> JointMotion:
        """Read the table; see ``JointReader.read``."""
        first, *rows = (row for row in read_rows(path, "CSV") if any(row))
        cells = [cell.strip() for cell in first]
        names = []
        units = set[str]()
        for cell in cells[1:]:
            matched = _UNIT.match(cell)
            names.append((matched[1] if matched else cell).strip() or cell)
            units.add("?" if matched is None else matched[2].lower()[:3])
        for line, row in enumerate(rows, start=2):
            if any(row[len(cells) :]):
                raise InputError(
                    f"{path}: line {line}: {len(row)} cells, the first line names {len(cells)}"
                )
        values = numbers_of(path, rows, cells, range(2, len(rows) + 2))
        unit = _unit_of(path, units, request)
        angles = radians(
            f"{path}:", values[:, 1:], unit, "or end the names of columns in _rad or _deg"
        )
        time_s = values[:, 0] * _time_unit_s(path, cells[0], request, values[:, 0])
        return joint_motion(path, time_s, names, angles)


def _time_unit_s(path: Path, column: str, request: JointRequest, time: Floats) -> float:
    """Return the size in seconds of the unit that the column of time or the user states."""
    stated = _TIME.fullmatch(_plain_name(column))
    unit = None if stated is None else stated[1] or stated[2]
    if unit is not None and request.time_unit not in (None, unit):
        raise InputError(
            f"--time-unit {request.time_unit}: {path} states {unit}; leave the option out"
        )
    return second(path, time, column, unit or request.time_unit)


def _plain_name(name: str) -> str:
    """Return a column's name in lower case, ``time [s]`` as ``time_s``."""
    return re.sub(r"[\s_]*[\[(](\w+)[\])]", r"_\1", name.strip().lower())


def _unit_of(path: Path, stated: set[str], request: JointRequest) -> str | None:
    """Return the unit that all columns state, or that the user gives.

    Raises:
        InputError: both state one.

    """
    if len(stated) != 1 or "?" in stated:
        return request.unit
    (unit,) = stated
    if request.unit not in (None, unit):
        raise InputError(f"--unit {request.unit}: {path} states {unit}; leave the option out")
    return unit
