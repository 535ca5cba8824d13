"""A sweep in one row for each gait and robot: the defaults, and the best point of each kind."""

import math

from snakewalk.controller.app.studies.sweep_table import number
from snakewalk.controller.gaits.gait import Aim
from snakewalk.controller.gaits.registry import GAITS

UNITS: dict[Aim, str] = {"way": "m/s", "climb": "m/s up", "turn": "rad/s"}


def digest(rows: list[dict[str, str]]) -> list[dict[str, object]]:
    """Return one row a gait and robot, in the order in which they appear."""
    found: list[dict[str, object]] = []
    for gait, robot in dict.fromkeys((row["gait"], row["robot"]) for row in rows):
        some = [row for row in rows if (row["gait"], row["robot"]) == (gait, robot)]
        ran = [row for row in some if row["cycles"] and row["ended"] == "ran to its end"]
        first = next((row for row in ran if row["number"] == "0"), None)
        found.append(
            {
                "gait": gait,
                "robot": robot,
                "points": len(some),
                "tripped": len(some) - len(ran),
                "default_bl_cycle": _round(math.nan if first is None else way_bl(first), 3),
                "most_bl_cycle": _round(_most([way_bl(row) for row in ran]), 3),
                "default_pace": _round(math.nan if first is None else pace(first), 3),
                "most_pace": _round(_most([pace(row) for row in ran]), 3),
                "pace": UNITS[GAITS[gait].aim],
                "default_cost": _round(_of(first, "cost_of_transport"), 2),
                "least_cost": _round(-_most([-number(r, "cost_of_transport") for r in ran]), 2),
                "peak_torque_n_m": _round(_peak(ran, "peak_torque_n_m"), 2),
                "peak_c": _round(_peak(ran, "peak_temperature_c"), 1),
                "default_slip": _round(_of(first, "slip"), 2),
            }
        )
    return found


def pace(row: dict[str, str]) -> float:
    """How fast the gait does what it is there for: m/s over ground or upwards, rad/s turned."""
    aim = GAITS[row["gait"]].aim
    if aim == "turn":
        return abs(number(row, "turn_rad_cycle")) * number(row, "ran_hz")
    return abs(number(row, "climb_m_s" if aim == "climb" else "speed_m_s"))


def way_bl(row: dict[str, str]) -> float:
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
