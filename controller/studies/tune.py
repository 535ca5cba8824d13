"""Fastest or cheapest parameters of a gait, by differential evolution.

R. Storn, K. Price, J. Global Optimization 11, 341-359, 1997, in scipy: it needs no gradient, keeps
the ranges, and runs a generation in parallel.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.console.pool import process_pool
from snakewalk.controller.gaits.gait import Aim as Goal
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.run.kinds.gait_factory import gait_keys
from snakewalk.controller.run.run_keys import with_keys_of
from snakewalk.controller.studies.sweep_measure import Measurement, measure
from snakewalk.controller.studies.sweep_points import Point, Space, robot_file

Aim = Literal["speed", "efficiency"]
LAGGARD = 0.5
"""Share of the defaults' speed from which a gait counts as moving, for efficiency."""
_WORST_SCORE = 1e3


@dataclass(frozen=True, slots=True)
class Task:
    """Requirements for a gait."""

    aim: Aim
    goal: Goal
    toward: tuple[float, float] = (1.0, 0.0)
    """Direction of the defaults, forward and left; another one is another gait."""
    least: float = 0.0
    """Pace of the defaults."""


def pace(row: Measurement, task: Task) -> float:
    """Pace in the gait's purpose, m/s or rad/s; 0 for an incomplete run."""
    if row.ended != "ran to its end" or row.speed_m_s is None:
        return 0.0
    if task.goal == "turn":
        return abs(_value(row.turn_rad_cycle)) * _value(row.ran_hz)
    if task.goal == "climb":
        return abs(_value(row.climb_m_s))
    moved = _value(row.forward_bl_cycle), _value(row.left_bl_cycle)
    share = (moved[0] * task.toward[0] + moved[1] * task.toward[1]) / max(math.hypot(*moved), 1e-12)
    return max(0.0, _value(row.speed_m_s) * share)


def loss(row: Measurement, task: Task) -> float:
    """Minimised quantity; a gait that trips, is derated, or hardly moves is rejected."""
    speed = pace(row, task)
    if speed <= 0.0 or _value(row.least_rate) < 1.0:
        return _WORST_SCORE
    if task.aim == "speed":
        return -speed
    if speed < LAGGARD * task.least:
        return _WORST_SCORE * (1.0 - speed / max(task.least, 1e-9))
    return cost(row, task)


def task_of(row: Measurement, aim: Aim, goal: Goal) -> Task:
    """Return a task that judges parameters against the defaults' result."""
    forward, left = _value(row.forward_bl_cycle), _value(row.left_bl_cycle)
    size = math.hypot(forward, left)
    toward = (forward / size, left / size) if size > 1e-9 else (1.0, 0.0)
    task = Task(aim, goal, toward)
    return replace(task, least=pace(row, task))


def cost(row: Measurement, task: Task) -> float:
    """Cost of transport, or joules a radian."""
    if task.goal == "turn":
        return _value(row.power_w) / pace(row, task)
    return _value(row.cost_of_transport)


def _value(value: float | None) -> float:
    return math.nan if value is None else value


_GENERATION = 8
"""Points per parameter and generation; scipy's 15 are too many for physics."""


@dataclass(frozen=True, slots=True)
class Tuned:
    """Parameters found, compared with the defaults over several seeds."""

    gait: str
    robot: str
    aim: Aim
    parameters: dict[str, Any]
    tried: int
    default: tuple[float, ...]
    """Speed in m/s (rad/s for a turn in place), or cost of transport, per seed."""
    best: tuple[float, ...]

    @property
    def margin(self) -> float:
        """Relative improvement of the mean: 0.2 is a fifth faster or cheaper."""
        before, after = float(np.mean(self.default)), float(np.mean(self.best))
        return after / before - 1.0 if self.aim == "speed" else 1.0 - after / before

    @property
    def better_seeds(self) -> int:
        """Number of seeds with a better result than the defaults."""
        better = np.array(self.best) > np.array(self.default)
        return int((better if self.aim == "speed" else ~better).sum())


class Search(NamedTuple):
    """Size of a search."""

    budget: int
    """Approximate number of runs."""
    seeds: int
    """Number of grounds for the comparison with the defaults."""
    seconds: float
    """Duration of a run."""
    seed: int


def tune(
    gait: str,
    robot: str,
    aim: Aim,
    *,
    search: Search,
    workers: int,
    keys: Mapping[str, Any] | None = None,
    on_progress: Callable[[int], None] = lambda done: None,
) -> Tuned:
    """Search parameters, then compare them with the defaults on other grounds.

    ``keys`` as in ``prepare_gait``.

    Raises:
        InputError: no such gait or robot, or they do not fit.

    """
    budget, seeds, seconds, seed = search
    keys = gait_keys(keys)
    body = with_keys_of("robot", load_robot(robot), keys)
    kind = type(make_gait(gait))
    with_keys_of("world", load_world(kind.world), keys)
    kind().check(body)
    space = Space.of(kind)
    place = (gait, robot_file(robot) or body.name, kind.world)
    start = Point(*place, 0, seed, seconds, keys=tuple(keys.items()))
    default = kind().params.model_dump()
    with process_pool(workers) as pool:
        first = measure(start)
        task = task_of(first, aim, kind.aim)
        if task.least <= 0.0:
            raise InputError(f"{gait} on {robot}: the defaults do not move it: {first.ended}")
        done = 1

        def rate(work: Callable[[Floats], float], units: Iterable[Floats]) -> Sequence[float]:
            nonlocal done
            losses = []
            for value in pool.map(work, units):
                done += 1
                on_progress(done)
                losses.append(value)
            return losses

        dimensions = len(space.spans)
        people = max(5, _GENERATION)
        best = differential_evolution(
            partial(_rated_pace, start=start, task=task),
            Bounds([0.0] * dimensions, [1.0] * dimensions),
            x0=space.unit(default),
            init=_first_generation(space.unit(default), people, np.random.default_rng(seed)),
            maxiter=max(1, budget // people - 1),
            mutation=(0.4, 0.9),
            recombination=0.9,
            polish=False,
            updating="deferred",
            workers=rate,
            rng=np.random.default_rng(seed),
            tol=0.0,
        )
        values = space.values(best.x)
        tuned = replace(start, number=1, parameters=values)
        others = range(seed + 1, seed + 1 + seeds)
        score_of = partial(_scored_point, task=task)
        before = tuple(pool.map(partial(score_of, start), others))
        after = tuple(pool.map(partial(score_of, tuned), others))
    return Tuned(gait, body.name, aim, values, done, before, after)


def _first_generation(centre: Floats, people: int, rng: np.random.Generator) -> Floats:
    """First generation: the defaults, half of the others near them, the rest anywhere."""
    near = np.clip(centre + 0.15 * rng.standard_normal((people // 2, len(centre))), 0.0, 1.0)
    far = rng.random((people - len(near), len(centre)))
    return np.vstack([near, far])


def _rated_pace(unit: Floats, *, start: Point, task: Task) -> float:
    values = Space.of(type(make_gait(start.gait))).values(unit)
    row = measure(replace(start, parameters=values))
    return loss(row, task)


def _scored_point(point: Point, vary: int, *, task: Task) -> float:
    row = measure(point, vary=vary)
    if task.aim == "speed":
        return pace(row, task)
    if pace(row, task) <= 0.0:
        return math.inf
    return cost(row, task)
