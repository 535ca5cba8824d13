"""Number of curves that equal chords divide ([PT] 2.3): smooth bodies and zigzags."""

import time
from collections import Counter
from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks.rows import Row
from snakewalk.config.arrays import Floats
from snakewalk.controller.images.equipartition import NoEquipartitionError, equipartition

TITLE = "Equal chords: curves that are divided"

FIRST_SEED = 3000
BODIES = 150
ZIGZAGS = 60


def run() -> list[Row]:
    """Measure."""
    rows = []
    for segments in (3, 4, 5, 6, 7, 8):
        rows += _divided(f"smooth bodies, {segments} chords", smooth_body, BODIES, segments)
    for turn_rad in (0.6, 1.0, 1.25, 1.5, 2.0, 3.0):
        name = f"zigzags of {turn_rad} rad, 100 chords"
        rows += _divided(name, partial(zigzag, turn_rad=turn_rad), ZIGZAGS, 100)
    return rows


def smooth_body(seed: int) -> Floats:
    """Return a body (201, 2) of four random waves of its tangent angle."""
    random, share = np.random.default_rng(seed), np.linspace(0.0, 1.0, 200)
    angle = np.zeros(200)
    for k in range(1, 5):
        size = random.normal(0.0, 2.2 / k**0.7)
        angle += size * np.sin(2.0 * np.pi * k * share + random.uniform(0.0, 2.0 * np.pi))
    step = np.column_stack([np.cos(angle), np.sin(angle)]) / 200.0
    return np.vstack([[0.0, 0.0], np.cumsum(step, axis=0)])


def zigzag(seed: int, turn_rad: float) -> Floats:
    """Return a random walk (60, 2) with turns of this standard deviation."""
    angle = np.cumsum(np.random.default_rng(seed).normal(size=60) * turn_rad)
    return np.cumsum(np.column_stack([np.cos(angle), np.sin(angle)]), axis=0)


def _divided(name: str, curve: Callable[[int], Floats], number: int, segments: int) -> list[Row]:
    methods: Counter[str] = Counter()
    slowest = 0.0
    for seed in range(FIRST_SEED, FIRST_SEED + number):
        begin = time.process_time()
        try:
            found = equipartition(curve(seed), segments)
        except NoEquipartitionError:
            methods["rejected"] += 1
        else:
            size = np.hypot(*np.diff(found.points, axis=0).T)
            if np.ptp(size) > 1e-7 or (np.diff(found.at) <= 0.0).any():
                raise AssertionError(f"{name}, seed {seed}: the chords differ")
            methods[found.method] += 1
        slowest = max(slowest, time.process_time() - begin)
    return [
        Row(f"{name}: divided of {number}", number - methods["rejected"], ""),
        Row(f"{name}: by a sample of branches", methods["sample"], ""),
        Row(f"{name}: slowest", slowest * 1e3, "ms"),
    ]
