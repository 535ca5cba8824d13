"""Joint angles as a CSV: a column of time, then a column for each joint."""

import re
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.file_units import ANGLES_RAD, DEGREE, TIMES_S
from snakewalk.config.playback import JointRequest
from snakewalk.config.reading import by_names, stated
from snakewalk.config.table_columns import with_meanings
from snakewalk.config.text_table import numbers_of, read_rows
from snakewalk.controller.console.command import plugin
from snakewalk.controller.motion.joint_motion import (
    JointMotion,
    joint_motion,
    radians,
    time_unit,
)

_TIME = re.compile("(?:time|t|timestamp)(?:_(s|ms|us|ns))?|(s)econds")
"""Name of the column of time, and the unit that it states."""
_MIDLINE_COLUMNS = {"frame", "point", "frame_idx", "scorer"}
_UNIT = re.compile(r"^(.*?)[ _.]?[\[(]?(rad|deg|radians|degrees|°)[\])]?$", re.IGNORECASE)


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
        notes: list[str] = []
        every = with_meanings(path, read_rows(path, "CSV"), request.columns, notes)
        first, *rows = (row for row in every if any(row))
        cells = [cell.strip() for cell in first]
        if not cells[-1] and not any(row[len(cells) - 1 :] and row[len(cells) - 1] for row in rows):
            cells.pop()
        names = []
        units = []
        for cell in cells[1:]:
            matched = _UNIT.match(cell)
            names.append((matched[1] if matched else cell).strip() or cell)
            units.append("?" if matched is None else matched[2].lower().replace("°", DEGREE)[:3])
        for line, row in enumerate(rows, start=2):
            if any(row[len(cells) :]):
                raise InputError(
                    f"{path}: line {line}: {len(row)} cells, the first line names {len(cells)}"
                )
        values = numbers_of(path, rows, cells, range(2, len(rows) + 2))
        kinds = dict.fromkeys(units)
        if "?" in kinds and len(kinds) > 1:
            raise InputError(
                f"{path}: column {cells[1 + units.index('?')]} states no unit of angles, and "
                "others do; end its name in _rad or _deg"
            )
        joined = None if "?" in kinds else " and ".join(kinds)
        by_name = by_names(joined, cells[1:], request.columns)
        unit = stated(path, "--unit", by_name, request.unit)
        if by_name is None or unit is None:
            hint = "or end the names of columns in _rad or _deg"
            angles, unit = radians(str(path), values[:, 1:], unit, hint)
        else:
            angles = values[:, 1:] * [ANGLES_RAD[kind] for kind in units]
        match = _TIME.fullmatch(_plain_name(cells[0]))
        word = None if match is None else match[1] or match[2]
        by_name = by_names(word, cells[:1], request.columns)
        time = stated(path, "--time-unit", by_name, request.time_unit)
        time = time_unit(path, values[:, 0], cells[0], time)
        time_s = values[:, 0] * TIMES_S[time.value]
        return joint_motion(path, time_s, names, angles, notes, unit=unit, time=time)


def _plain_name(name: str) -> str:
    """Return a column's name in lower case, ``time [s]`` as ``time_s``."""
    return re.sub(r"[\s_]*[\[(](\w+)[\])]", r"_\1", name.strip().lower())
