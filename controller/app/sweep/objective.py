"""What a gait is tuned for: its pace, its cost, and what the search makes small."""

import math
from dataclasses import dataclass, replace
from typing import Literal

from controller.app.sweep.measure import Row
from controller.gaits.gait import Aim as Goal

Aim = Literal["speed", "efficiency"]
LAGGARD = 0.5
"""For efficiency: share of the defaults' speed below which a gait does not count as moving."""
_WORST = 1e3


@dataclass(frozen=True, slots=True)
class Task:
    """What is asked of a gait."""

    aim: Aim
    goal: Goal
    toward: tuple[float, float] = (1.0, 0.0)
    """Unit vector, forward and left: where the defaults go. Another way is another gait."""
    least: float = 0.0
    """Pace of the defaults."""


def pace(row: Row, task: Task) -> float:
    """How fast it does what it is there for, m/s or rad/s; 0 where it did not run to its end."""
    if row.get("ended") != "ran to its end" or row.get("speed_m_s") is None:
        return 0.0
    if task.goal == "turn":
        return abs(_value(row, "turn_rad_cycle")) * _value(row, "ran_hz")
    if task.goal == "climb":
        return abs(_value(row, "climb_m_s"))
    way = _value(row, "forward_bl_cycle"), _value(row, "left_bl_cycle")
    share = (way[0] * task.toward[0] + way[1] * task.toward[1]) / max(math.hypot(*way), 1e-12)
    return max(0.0, _value(row, "speed_m_s") * share)


def loss(row: Row, task: Task) -> float:
    """What is made small; a gait that trips, is derated, or hardly moves is no answer."""
    speed = pace(row, task)
    if speed <= 0.0 or _value(row, "least_rate") < 1.0:
        return _WORST
    if task.aim == "speed":
        return -speed
    if speed < LAGGARD * task.least:
        return _WORST * (1.0 - speed / max(task.least, 1e-9))
    return cost(row, task)


def task_of(row: Row, aim: Aim, goal: Goal) -> Task:
    """Judge others by what the defaults do."""
    forward, left = _value(row, "forward_bl_cycle"), _value(row, "left_bl_cycle")
    size = math.hypot(forward, left)
    toward = (forward / size, left / size) if size > 1e-9 else (1.0, 0.0)
    task = Task(aim, goal, toward)
    return replace(task, least=pace(row, task))


def cost(row: Row, task: Task) -> float:
    """Cost of transport, or joules a radian."""
    if task.goal == "turn":
        return _value(row, "power_w") / pace(row, task)
    return _value(row, "cost_of_transport")


def _value(row: Row, key: str) -> float:
    value = row.get(key)
    return float(value) if isinstance(value, int | float) else math.nan
