"""Steps a second of the Gymnasium environment on one core: undisturbed, and as the machine is.

The same episode is run again and again. The least time that each of its steps has taken is that of
a core which nothing else disturbs; the processor time of whole episodes says what a busy machine,
whose programs share caches and clock, leaves of it.
"""

import sys
import time
from typing import Any

import gymnasium
import numpy as np

import snakewalk.gym  # noqa: F401  registers the environment
from benchmarks.rows import Row

TITLE = "A step of the Gymnasium environment"
STEPS, EPISODES = 160, 20
TARGET_US = 500.0
"""2,000 steps a second."""


def run() -> list[Row]:
    """Measure the environments by turns."""
    name = "snakewalk/Snake-v0"
    environments: dict[str, Any] = {
        "env.unwrapped, physics in steps of 5 ms": gymnasium.make(name).unwrapped,
        "with the wrappers of make": gymnasium.make(name),
        "with the wrappers, physics in steps of 2 ms": gymnasium.make(name, physics_step_s=0.002),
    }
    joints = np.arange(environments["with the wrappers of make"].action_space.shape[0])
    actions = [
        (0.4 * min(1.0, k / 50) * np.sin(0.1 * k - 0.7 * joints)).astype(np.float32)
        for k in range(STEPS)
    ]
    least_ns = {each: np.full(STEPS, sys.maxsize) for each in environments}
    cpu_s: dict[str, list[float]] = {each: [] for each in environments}
    for _ in range(EPISODES):
        for each, environment in environments.items():
            environment.reset(seed=1)
            begun_s = time.process_time()
            for k, action in enumerate(actions):
                step_ns = time.perf_counter_ns()
                environment.step(action)
                least_ns[each][k] = min(least_ns[each][k], time.perf_counter_ns() - step_ns)
            cpu_s[each].append(time.process_time() - begun_s)
    found = []
    for each in environments:
        least_us = 1e-3 * float(least_ns[each].mean())
        busy_us = 1e6 * float(np.median(cpu_s[each])) / STEPS
        target = None if "2 ms" in each else 1.0
        against = "2,000 steps a second"
        found += [
            Row(f"{each}, undisturbed", least_us, "us", against, least_us / TARGET_US, target),
            Row(f"{each}, processor time", busy_us, "us", against, busy_us / TARGET_US),
        ]
    return found
