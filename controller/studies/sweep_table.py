"""Table of a sweep, one tidy CSV, and its digest.

The table has a row per finished point; the digest one per gait and robot, with the defaults and the
best points.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from snakewalk.controller.console.parquet import Kind
from snakewalk.controller.console.rounding import rounded
from snakewalk.controller.console.table import CsvTable, read_csv_table
from snakewalk.controller.gaits.gait import Aim
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.studies.sweep_measure import Measurement
from snakewalk.controller.studies.sweep_points import Point

_PLACE = ("gait", "robot", "world", "keys", "number", "seed", "seconds")
_MEASURED_COLUMNS = tuple(field.name for field in fields(Measurement))
_PARAMETERS = tuple(sorted({key for gait in GAITS.values() for key in gait.model.model_fields}))
COLUMNS = (*_PLACE, *_MEASURED_COLUMNS, *_PARAMETERS)
"""A cell is empty if the gait lacks the parameter, or the value is unknown."""
_TEXT = ("gait", "robot", "world", "keys", "ended", "pose_evidence", "pose_source", "backend")
_INTEGER = ("number", "seed", "cycles")
_TRUTH = tuple(
    key
    for gait in GAITS.values()
    for key, field in gait.model.model_fields.items()
    if field.annotation is bool
)


def _kind(column: str) -> Kind:
    if column in _TEXT:
        return "text"
    if column in _INTEGER:
        return "integer"
    return "truth" if column in _TRUTH else "number"


KINDS: dict[str, Kind] = {column: _kind(column) for column in COLUMNS}
"""Kind of each column in a Parquet file."""


def read_table(path: Path) -> list[dict[str, str]]:
    """Read the complete rows of a table; a torn last line is dropped.

    Raises:
        InputError: it is not the table of a sweep.

    """
    return list(table_rows(path))


def table_rows(path: Path) -> Iterator[dict[str, str]]:
    """Yield the complete rows of a table; otherwise as ``read_table``."""
    return read_csv_table(path, COLUMNS, "sweep")


class SweepTable(CsvTable):
    """Finished points."""

    def __init__(self, path: Path) -> None:
        """Open or make the table.

        Raises:
            InputError: the file is something else.

        """
        super().__init__(
            path,
            columns=COLUMNS,
            place=_PLACE,
            command="gait sweep",
            keeps_rows=False,
        )

    def missing(self, points: list[Point]) -> list[Point]:
        """The entries of ``points`` that the table lacks."""
        return [point for point in points if self.held(point.key) is None]

    def add(self, point: Point, row: Measurement) -> None:
        """Append a finished point."""
        place = dict(zip(_PLACE, point.key, strict=True))
        values = GAITS[point.gait].of(dict(point.parameters)).params.model_dump()
        table_entry = place | {k: v for k, v in (asdict(row) | values).items() if v is not None}
        self.append(table_entry)


def number(row: dict[str, str], key: str) -> float:
    """A cell as a number; NaN where it is empty."""
    return float(row[key]) if row[key] else float("nan")


UNITS: dict[Aim, str] = {"advance": "m/s", "climb": "m/s up", "turn": "rad/s"}


@dataclass(frozen=True, slots=True)
class GaitDigest:
    """A gait on a robot in a sweep, rounded; None if unknown."""

    gait: str
    robot: str
    keys: str
    """Values that were replaced, ``KEY=VALUE KEY=VALUE``."""
    points: int
    tripped: int
    """Points that did not run to their end."""
    default_bl_cycle: float | None
    """Body lengths a cycle, over ground, with the default parameters."""
    most_bl_cycle: float | None
    default_pace: float | None
    most_pace: float | None
    pace: str
    """Unit of both paces."""
    default_cost: float | None
    """Cost of transport."""
    least_cost: float | None
    peak_torque_n_m: float | None
    peak_c: float | None
    default_slip: float | None


class _Running:
    def __init__(self) -> None:
        self.points = self.ran = 0
        self.first: dict[str, str] | None = None
        self.most_bl = self.most_pace = self.least_cost = math.nan
        self.torque_n_m = self.celsius = math.nan

    def add(self, row: dict[str, str]) -> None:
        self.points += 1
        if not row["cycles"] or row["ended"] != "ran to its end":
            return
        self.ran += 1
        if self.first is None and row["number"] == "0":
            self.first = row
        self.most_bl = _largest_value([self.most_bl, distance_bl(row)])
        self.most_pace = _largest_value([self.most_pace, pace(row)])
        self.least_cost = -_largest_value([-self.least_cost, -number(row, "cost_of_transport")])
        self.torque_n_m = _largest_value([self.torque_n_m, abs(number(row, "peak_torque_n_m"))])
        self.celsius = _largest_value([self.celsius, abs(number(row, "peak_temperature_c"))])


def digest(rows: Iterable[dict[str, str]]) -> list[GaitDigest]:
    """Return one row per gait, robot and set of replaced values, in their order."""
    running_by_key: dict[tuple[str, str, str], _Running] = {}
    for row in rows:
        running_by_key.setdefault((row["gait"], row["robot"], row["keys"]), _Running()).add(row)
    return [
        GaitDigest(
            gait=gait,
            robot=robot,
            keys=keys,
            points=some.points,
            tripped=some.points - some.ran,
            default_bl_cycle=rounded(
                math.nan if some.first is None else distance_bl(some.first), 3
            ),
            most_bl_cycle=rounded(some.most_bl, 3),
            default_pace=rounded(math.nan if some.first is None else pace(some.first), 3),
            most_pace=rounded(some.most_pace, 3),
            pace=UNITS[GAITS[gait].aim],
            default_cost=rounded(_number_of(some.first, "cost_of_transport"), 2),
            least_cost=rounded(some.least_cost, 2),
            peak_torque_n_m=rounded(some.torque_n_m, 2),
            peak_c=rounded(some.celsius, 1),
            default_slip=rounded(_number_of(some.first, "slip"), 2),
        )
        for (gait, robot, keys), some in running_by_key.items()
    ]


def pace(row: dict[str, str]) -> float:
    """Pace in the gait's purpose: m/s over ground or upwards, or rad/s turned."""
    aim = GAITS[row["gait"]].aim
    if aim == "turn":
        return abs(number(row, "turn_rad_cycle")) * number(row, "ran_hz")
    return abs(number(row, "climb_m_s" if aim == "climb" else "speed_m_s"))


def distance_bl(row: dict[str, str]) -> float:
    """Body lengths a cycle, over ground."""
    return math.hypot(number(row, "forward_bl_cycle"), number(row, "left_bl_cycle"))


def _number_of(row: dict[str, str] | None, key: str) -> float:
    return math.nan if row is None else number(row, key)


def _largest_value(values: list[float]) -> float:
    finite_values = [value for value in values if math.isfinite(value)]
    return max(finite_values, default=math.nan)
