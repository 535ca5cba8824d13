"""A policy's wave by CMA-ES, on episodes of the environment.

N. Hansen, A. Ostermeier, Completely Derandomized Self-Adaptation in Evolution Strategies,
Evolutionary Computation 9 (2), 159-195, 2001, in the package ``cma``.
"""

from collections.abc import Callable
from contextlib import nullcontext
from functools import cache, partial
from importlib.metadata import version

import cma
import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.config.base import Strict
from snakewalk.config.loader import load_world
from snakewalk.controller.console.pool import process_pool
from snakewalk.controller.learning.environment import SnakeEnvironment
from snakewalk.controller.motion.policy import WAVE_SPAN, Origin, Policy, PolicyWave
from snakewalk.controller.motion.policy_motion import PolicyMotion

_SIGMA = 0.3
"""First spread of the candidates, in ``WAVE_SPAN`` (ours)."""


class SearchProgress(Strict):
    """Rewards of the generations so far; with its arguments they determine the rest of a search."""

    robot: str = Field(description="robot that the search moves")
    world: str = Field(description="world that the search uses")
    population: int = Field(description="candidates in a generation")
    steps: int = Field(description="control steps of a trial")
    seed: int = Field(description="seed of the search")
    software: str = Field(description="version that made the file")
    """Names and versions; others may draw other candidates."""
    rewards_m: tuple[tuple[float, ...], ...] = Field(
        (), description="distance that each candidate travelled, by generation"
    )
    """Rewards of each generation, one for each candidate."""


def search_progress(
    *, robot: str, world: str, population: int, steps: int, seed: int
) -> SearchProgress:
    """Progress of a search at its beginning."""
    software = f"snakewalk {version('snakewalk')}, cma {version('cma')}"
    return SearchProgress(
        robot=robot, world=world, population=population, steps=steps, seed=seed, software=software
    )


def search_wave(
    name: str,
    progress: SearchProgress,
    *,
    generations: int,
    workers: int,
    on_progress: Callable[[SearchProgress], None] = lambda progress: None,
) -> Policy:
    """Search the wave whose episodes earn most; the same one for the same arguments.

    Each candidate has one episode; all of a generation have the same start, each generation
    another one. The result is the mean of the last generation's distribution, which has seen more
    starts than any of its members.

    Args:
        name: of the policy.
        progress: where the search begins; the generations in it are not simulated again.
        generations: in all.
        workers: processes.
        on_progress: gets the progress after each generation.

    Raises:
        InputError: the robot or the world does not exist.

    """
    start = PolicyWave().vector()
    robot = progress.robot
    world = progress.world
    seed = progress.seed
    steps = progress.steps
    population = progress.population
    law = load_world(world).friction.law_name
    software = progress.software
    options = {"popsize": population, "seed": seed + 1, "verbose": -9}  # 0 is the time of day
    strategy = cma.CMAEvolutionStrategy(np.zeros(len(start)), _SIGMA, options)

    def policy(genes: Floats, asked: int) -> Policy:
        origin = Origin(
            method="cma",
            seed=seed,
            steps=asked * steps,
            world=world,
            law=law,
            software=software,
        )
        wave = PolicyWave.of(start + WAVE_SPAN * genes)
        return Policy(name=name, robot=robot, origin=origin, wave=wave)

    with process_pool(workers) if workers > 1 else nullcontext() as pool:
        rate = map if pool is None else pool.map
        for generation in range(generations):
            genes = strategy.ask()
            if generation < len(progress.rewards_m):
                rewards = progress.rewards_m[generation]
                strategy.tell(genes, [-reward_m for reward_m in rewards])
                continue
            work = partial(_earned_reward, world=world, start=seed + generation, steps=steps)
            rewards = tuple(rate(work, [policy(gene, 0) for gene in genes]))
            strategy.tell(genes, [-reward_m for reward_m in rewards])
            rewards_m = (*progress.rewards_m, rewards)
            progress = progress.model_copy(update={"rewards_m": rewards_m})
            on_progress(progress)
    return policy(strategy.result.xfavorite, generations * population)


def episode_reward_m(snake: SnakeEnvironment, policy: Policy, *, seed: int, steps: int) -> float:
    """Let a policy move a snake for ``steps``, or until safety trips; returns the rewards' sum."""
    snake.reset(seed=seed)
    motion = PolicyMotion(policy, snake.robot)
    earned_m = 0.0
    for _ in range(steps):
        goal_rad = motion.step(snake.period_s, snake.view)
        _, reward_m, tripped, _, _ = snake.step(goal_rad / snake.limit_rad)
        earned_m += reward_m
        if tripped:
            break
    return earned_m


def _earned_reward(policy: Policy, *, world: str, start: int, steps: int) -> float:
    snake = _environment(policy.robot, world)
    return episode_reward_m(snake, policy, seed=start, steps=steps)


_environment = cache(SnakeEnvironment)
"""Environment of a robot and a world, once a process: it costs as much as an episode."""
