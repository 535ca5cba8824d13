"""The tongue: a second-order Markov chain over heights ([PT] 2.6.6), for any head accessory.

``P(H(t) | H(t - 1), H(t - 2))`` is counted on a short sequence. A height of 0 is in and 1 is out.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.text_table import numbers_of, read_rows


def flicks(rate_hz: float = 25.0) -> Floats:
    """Make a sequence (T,) to learn from: no tracked one is published.

    Three bursts of two to four quick strokes, each out in a sixth of a second, with rests between.
    """
    stroke = np.abs(np.sin(np.pi * np.arange(round(rate_hz / 3.0)) / round(rate_hz / 3.0)))
    rest = np.zeros(round(0.8 * rate_hz))
    parts = [part for strokes in (2, 4, 3) for part in (rest, *[stroke] * strokes)]
    return np.concatenate([*parts, rest])


@dataclass(frozen=True, slots=True)
class TongueRecord:
    """Heights of a tongue over time, to learn from."""

    heights: Floats
    """(T,) position of the tongue: 0 drawn in, 1 out."""
    rate_hz: float
    evidence: str
    """Evidence of the motion: measured, by a file; or assumed."""
    source: str

    @classmethod
    def made_up(cls) -> "TongueRecord":
        """Use ``flicks``."""
        return cls(flicks(), 25.0, "assumed", "random bursts of strokes")

    @classmethod
    def read(cls, file: Path) -> "TongueRecord":
        """Read a CSV table with a header: ``time_s``, and ``length_m`` or ``height`` (0 to 1).

        The longest ``length_m`` is a height of 1.

        Raises:
            InputError: the file or a column is missing, a value is wrong, or times are uneven.

        """
        try:
            first, *cells = read_rows(file, "CSV table of the tongue") or [[]]
        except OSError as error:
            raise InputError(f"{file}: {error}; name a CSV table of the tongue") from None
        kind = next((name for name in ("height", "length_m") if name in first), None)
        if "time_s" not in first or kind is None:
            raise InputError(f"{file}: the header must name time_s, and height or length_m")
        rows = numbers_of(file, filter(any, cells), first, range(2, len(cells) + 2))
        time_s, value = (rows[:, first.index(name)] for name in ("time_s", kind))
        steps = np.diff(time_s)
        if len(rows) < 3 or not steps.min() > 0.0 or np.ptp(steps) > 0.05 * np.median(steps):
            raise InputError(f"{file}: time_s must rise evenly over three rows or more")
        most = float(value.max()) if kind == "length_m" else 1.0
        if not np.isfinite(value).all() or value.min() < 0.0 or value.max() > most or most <= 0.0:
            raise InputError(f"{file}: {kind} must be 0 or more, and a height at most 1")
        return cls(value / most, float(1.0 / np.median(steps)), "measured", file.name)


class HeightChain:
    """Transition counts of quantised heights, learned from one sequence."""

    def __init__(self, heights: Floats, levels: int = 9) -> None:
        """Count ``heights`` (T,) in 0..1 on ``levels`` values.

        Raises:
            ValueError: fewer than three heights or levels, or heights outside 0..1.

        """
        if len(heights) < 3 or levels < 3 or heights.min() < 0.0 or heights.max() > 1.0:
            raise ValueError("the tongue learns from three or more heights within 0..1")
        self.levels = levels
        level_indices = np.rint(heights * (levels - 1)).astype(np.intp)
        self._start = (int(level_indices[0]), int(level_indices[1]))
        counts = np.zeros((levels, levels, levels))  # (z, y, x): of height x after y after z
        # the sequence repeats, so that its last pair has a successor
        repeated = np.append(level_indices, level_indices[:2])
        np.add.at(counts, (repeated[:-2], repeated[1:-1], repeated[2:]), 1.0)
        total = counts.sum(axis=2, keepdims=True)
        self.probability = np.divide(counts, total, out=np.zeros_like(counts), where=total > 0.0)
        """(z, y, x): of height x after y after z; rows of pairs never seen are 0."""

    def sequence(self, steps: int, rng: np.random.Generator) -> Floats:
        """Draw heights (steps,) in 0..1, from the learned sequence's own beginning."""
        two, latest = self._start
        drawn = np.empty(steps, dtype=np.intp)
        cumulative = np.cumsum(self.probability, axis=2)
        for k in range(steps):
            x = int(np.searchsorted(cumulative[two, latest], rng.random(), side="right"))
            drawn[k] = min(x, self.levels - 1)
            two = latest
            latest = int(drawn[k])
        return drawn / (self.levels - 1)


class Tongue:
    """Heights over time, drawn ahead in blocks from one seed."""

    def __init__(self, chain: HeightChain, seed: int, rate_hz: float = 25.0) -> None:
        """Play ``chain`` at ``rate_hz``."""
        self._chain = chain
        self._seed = seed
        self._rate_hz = rate_hz
        self._heights = chain.sequence(256, np.random.default_rng(seed))

    def height(self, time_s: float) -> float:
        """Height at a time since the start, between samples linearly."""
        place = max(time_s, 0.0) * self._rate_hz
        while place > len(self._heights) - 1:  # the same seed again gives the same beginning
            more = 2 * len(self._heights)
            self._heights = self._chain.sequence(more, np.random.default_rng(self._seed))
        return float(np.interp(place, np.arange(len(self._heights)), self._heights))
