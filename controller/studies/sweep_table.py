"""The table of a sweep, one tidy CSV, and its digest.

The table has a row for each finished point, written when it finishes; the digest has one for each
gait and robot, with the defaults and the best point of each kind.
"""

import math
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from snakewalk.controller.console.table import CsvTable, read_csv_table
from snakewalk.controller.gaits.gait import Aim
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.studies.sweep_measure import Measurement
from snakewalk.controller.studies.sweep_points import Point

_PLACE = ("gait", "robot", "world", "keys", "number", "seed", "seconds")
_MEASURED = tuple(field.name for field in fields(Measurement))
_PARAMETERS = tuple(sorted({key for gait in GAITS.values() for key in gait.model.model_fields}))
COLUMNS = (*_PLACE, *_MEASURED, *_PARAMETERS)
"""Empty where a gait has no such parameter, or nothing could be measured."""


def read_table(path: Path) -> list[dict[str, str]]:
    """Read the whole rows of a table; a torn last line is dropped.

    Raises:
        InputError: no table of a sweep.

    """
    return read_csv_table(path, COLUMNS, "sweep")


class SweepTable(CsvTable):
    """Finished points."""

    def __init__(self, path: Path) -> None:
        """Open or make the table.

        Raises:
            InputError: the file is something else.

        """
        super().__init__(path, columns=COLUMNS, place=_PLACE, command="sweep")

    def missing(self, points: list[Point]) -> list[Point]:
        """The entries of ``points`` that the table lacks."""
        return [point for point in points if self.held(point.key) is None]

    def add(self, point: Point, row: Measurement) -> None:
        """Append a finished point."""
        place = dict(zip(_PLACE, point.key, strict=True))
        values = GAITS[point.gait].of(dict(point.parameters)).params.model_dump()
        found = place | {k: v for k, v in (asdict(row) | values).items() if v is not None}
        self.append(found)


def number(row: dict[str, str], key: str) -> float:
    """A cell as a number; NaN where it is empty."""
    return float(row[key]) if row[key] else float("nan")


UNITS: dict[Aim, str] = {"advance": "m/s", "climb": "m/s up", "turn": "rad/s"}


@dataclass(frozen=True, slots=True)
class GaitDigest:
    """A gait on a robot in a sweep, rounded for a reader; None: not known."""

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


def digest(rows: list[dict[str, str]]) -> list[GaitDigest]:
    """Return one row a gait, robot and set of replaced values, as they appear."""
    found: list[GaitDigest] = []
    cases = [(row["gait"], row["robot"], row["keys"]) for row in rows]
    for gait, robot, keys in dict.fromkeys(cases):
        some = [row for row, case in zip(rows, cases, strict=True) if case == (gait, robot, keys)]
        ran = [row for row in some if row["cycles"] and row["ended"] == "ran to its end"]
        first = next((row for row in ran if row["number"] == "0"), None)
        found.append(
            GaitDigest(
                gait=gait,
                robot=robot,
                keys=keys,
                points=len(some),
                tripped=len(some) - len(ran),
                default_bl_cycle=_round(math.nan if first is None else distance_bl(first), 3),
                most_bl_cycle=_round(_most([distance_bl(row) for row in ran]), 3),
                default_pace=_round(math.nan if first is None else pace(first), 3),
                most_pace=_round(_most([pace(row) for row in ran]), 3),
                pace=UNITS[GAITS[gait].aim],
                default_cost=_round(_of(first, "cost_of_transport"), 2),
                least_cost=_round(-_most([-number(r, "cost_of_transport") for r in ran]), 2),
                peak_torque_n_m=_round(_peak(ran, "peak_torque_n_m"), 2),
                peak_c=_round(_peak(ran, "peak_temperature_c"), 1),
                default_slip=_round(_of(first, "slip"), 2),
            )
        )
    return found


def pace(row: dict[str, str]) -> float:
    """How fast the gait does what it is there for: m/s over ground or upwards, rad/s turned."""
    aim = GAITS[row["gait"]].aim
    if aim == "turn":
        return abs(number(row, "turn_rad_cycle")) * number(row, "ran_hz")
    return abs(number(row, "climb_m_s" if aim == "climb" else "speed_m_s"))


def distance_bl(row: dict[str, str]) -> float:
    """Body lengths a cycle, over ground."""
    return math.hypot(number(row, "forward_bl_cycle"), number(row, "left_bl_cycle"))


def _of(row: dict[str, str] | None, key: str) -> float:
    return math.nan if row is None else number(row, key)


def _peak(rows: list[dict[str, str]], key: str) -> float:
    return _most([abs(number(row, key)) for row in rows])


def _most(values: list[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return max(known, default=math.nan)


def _round(value: float, digits: int) -> float | None:
    return round(value, digits) if math.isfinite(value) else None
