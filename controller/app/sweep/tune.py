"""The parameters of a gait that carry a robot fastest, or cheapest: differential evolution.

R. Storn, K. Price, J. Global Optimization 11, 341-359, 1997, as scipy has it: it needs no gradient,
keeps to the box of the parameters' ranges, and its generations run side by side.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, differential_evolution

from config.errors import InputError
from config.loader import load_robot
from controller.app.sweep.measure import measure
from controller.app.sweep.objective import Aim, Task, cost, loss, pace, task_of
from controller.app.sweep.points import Point, Space
from controller.gaits.registry import make_gait

Floats = NDArray[np.float64]
_GENERATION = 8
"""Points a parameter and generation would be scipy's 15; runs of physics are dear."""


@dataclass(frozen=True, slots=True)
class Tuned:
    """What was found, beside the defaults; tables over the seeds of ``compare``."""

    gait: str
    robot: str
    aim: Aim
    parameters: dict[str, Any]
    tried: int
    default: tuple[float, ...]
    """Speed in m/s (rad/s for a gait that turns on the spot), or cost of transport, a seed each."""
    best: tuple[float, ...]

    @property
    def margin(self) -> float:
        """How much better the mean is: 0.2 is a fifth faster, or a fifth cheaper."""
        before, after = float(np.mean(self.default)), float(np.mean(self.best))
        return after / before - 1.0 if self.aim == "speed" else 1.0 - after / before

    @property
    def wins(self) -> int:
        """Seeds on which it is better."""
        better = np.array(self.best) > np.array(self.default)
        return int((better if self.aim == "speed" else ~better).sum())


def tune(
    gait: str,
    robot: str,
    aim: Aim,
    *,
    budget: int,
    seeds: int,
    seconds: float,
    seed: int,
    workers: int,
    told: Callable[[int], None] = lambda done: None,
) -> Tuned:
    """Search with about ``budget`` runs, then compare with the defaults on ``seeds`` other grounds.

    Raises:
        InputError: no such gait or robot, or they do not fit.

    """
    body = load_robot(robot)
    kind = type(make_gait(gait))
    kind().check(body)
    space = Space.of(kind)
    start = Point(gait, body.name, kind.world, 0, seed, seconds)
    default = kind().params.model_dump()
    # fresh interpreters: forked ones would share MuJoCo's and numba's threads
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        first = measure(start)
        task = task_of(first, aim, kind.aim)
        if task.least <= 0.0:
            raise InputError(f"{gait} on {robot}: the defaults do not move it: {first['ended']}")
        done = 1

        def rate(work: Callable[[Floats], float], units: Iterable[Floats]) -> Sequence[float]:
            nonlocal done
            found = []
            for value in pool.map(work, units):
                done += 1
                told(done)
                found.append(value)
            return found

        dimensions = len(space.spans)
        people = max(5, _GENERATION)
        found = differential_evolution(
            partial(_rated, start=start, task=task),
            Bounds([0.0] * dimensions, [1.0] * dimensions),
            x0=space.unit(default),
            init=_around(space.unit(default), people, np.random.default_rng(seed)),
            maxiter=max(1, budget // people - 1),
            mutation=(0.4, 0.9),
            recombination=0.9,
            polish=False,
            updating="deferred",
            workers=rate,
            rng=np.random.default_rng(seed),
            tol=0.0,
        )
        values = space.values(found.x)
        tuned = replace(start, number=1, parameters=values)
        others = range(seed + 1, seed + 1 + seeds)
        one = partial(_scored, task=task)
        before = tuple(pool.map(partial(one, start), others))
        after = tuple(pool.map(partial(one, tuned), others))
    return Tuned(gait, body.name, aim, values, done, before, after)


def _around(centre: Floats, people: int, rng: np.random.Generator) -> Floats:
    """First generation: the defaults, half of the others near them, the rest anywhere."""
    near = np.clip(centre + 0.15 * rng.standard_normal((people // 2, len(centre))), 0.0, 1.0)
    far = rng.random((people - len(near), len(centre)))
    return np.vstack([near, far])


def _rated(unit: Floats, *, start: Point, task: Task) -> float:
    values = Space.of(type(make_gait(start.gait))).values(unit)
    row = measure(replace(start, parameters=values))
    return loss(row, task)


def _scored(point: Point, vary: int, *, task: Task) -> float:
    row = measure(point, vary=vary)
    if task.aim == "speed":
        return pace(row, task)
    if pace(row, task) <= 0.0:
        return math.inf
    return cost(row, task)
