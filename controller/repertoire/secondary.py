"""The secondary controller ([YT] 5.1): from a requested speed and turn to a segment."""

from copy import copy
from functools import cached_property
from typing import Self

import numpy as np

from snakewalk.config.arrays import Indices, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.repertoire.mixture import CYCLES, Mixtures
from snakewalk.controller.repertoire.repertoire import Repertoire


class SecondaryController:
    """Selects segments whose mean speed and turn over ten cycles are the requested ones.

    With ``patience`` it replaces a segment that it repeats for that many cycles. A requested
    speed has a direction: forward, backward, or at rest, which is below half of the slowest
    recorded speed. A segment of another direction is selected only if this direction has none.
    """

    def __init__(
        self,
        repertoire: Repertoire,
        *,
        scale: float = 1.0,
        patience: int | None = 6,
        seed: int = 0,
    ) -> None:
        """Select actions for a body of ``scale`` times the recorded size.

        ``patience``: cycles of one segment after which it changes, 1 or more; None: never.

        Raises:
            InputError: no segment goes forward.

        """
        segments = repertoire.segments
        self._names = [segment.name for segment in segments]
        self._kinds = np.array([segment.kind for segment in segments])
        self._steady = np.flatnonzero(self._kinds != "brake")
        brakes = np.flatnonzero(self._kinds == "brake")
        self._brake = int(brakes[0]) if len(brakes) else None
        self._scale = scale
        self._speed_m_s = np.array([segment.speed_m_s for segment in segments])
        self._turn_rad_s = np.array([segment.turn_rad_s for segment in segments])
        moves = self._kinds != "rest"
        self._direction = np.where(moves, np.sign(self._speed_m_s), 0.0).astype(int)
        steady_m_s = self._speed_m_s[self._steady]
        if not (self._direction[self._steady] > 0).any():
            raise InputError(
                f"repertoire of {repertoire.robot} on {repertoire.world}: no action goes forward "
                f"({self.available()}); record it on a ground with more friction across the body"
            )
        self._slowest_m_s = float(steady_m_s[self._direction[self._steady] > 0].min())
        back_m_s = -steady_m_s[self._direction[self._steady] < 0]
        self._slowest_back_m_s = float(back_m_s.min(initial=np.inf))
        self._duration_s = np.array([segment.duration_s for segment in segments])
        self._owed_cycles: Ints = np.zeros(len(segments), dtype=np.int64)
        self._patience = patience
        self._random = np.random.default_rng(seed)
        self._last: int | None = None
        self._repeats = 0

    def of_size(self, scale: float, seed: int) -> Self:
        """Return a new controller of a body of another size; it shares the mixtures."""
        assert self._mixtures, "each direction has segments"
        other = copy(self)
        other._scale = scale
        other._owed_cycles = np.zeros_like(self._owed_cycles)
        other._random = np.random.default_rng(seed)
        return other

    def choose(self, speed_m_s: float, turn_rad_s: float = 0.0) -> int:
        """Select the next cycle; a body that goes forward brakes before it rests.

        After ``patience`` equal ones a random other of the same kind and direction follows.
        """
        chosen = self._next_of_mixture(speed_m_s / self._scale, turn_rad_s)
        if self._kinds[chosen] == "rest":
            # a brake goes forward, also after an action that does not
            last = self._last
            forward = (
                last is not None and self._direction[last] > 0 and self._kinds[last] != "brake"
            )
            if forward and self._brake is not None:
                chosen = self._brake
        elif chosen == self._last and self._patience is not None:
            alike = (self._kinds == self._kinds[chosen]) & (
                self._direction == self._direction[chosen]
            )
            others = np.flatnonzero(alike)
            others = others[others != chosen]
            if self._repeats >= self._patience and len(others):
                chosen = int(self._random.choice(others))
        self._repeats = self._repeats + 1 if chosen == self._last else 1
        self._last = chosen
        return chosen

    def unreachable(self, speed_m_s: float, turn_rad_s: float) -> str:
        """Return the reachable speeds and turns in words; empty if a mixture meets both."""
        asked = np.array([speed_m_s / self._scale, turn_rad_s])
        if self._mixtures[self._requested_direction(asked[0])].best(asked)[1] <= 1.0:
            return ""
        ranges = []
        for axis, scale, unit, other in (
            (0, self._scale, "m/s", f"{turn_rad_s:g} rad/s"),
            (1, 1.0, "rad/s", f"{speed_m_s:g} m/s"),
        ):
            means = (scale * mixtures.span(axis, asked) for mixtures in self._mixtures.values())
            ends = (np.round([span.min(), span.max()], 2) + 0.0 for span in means if len(span))
            spans = dict.fromkeys(
                " to ".join(dict.fromkeys(f"{end:.2f}" for end in pair)) for pair in ends
            )
            if spans:
                ranges.append(f"with {other}: {' or '.join(spans)} {unit}")
        return "; ".join(ranges) or self.available()

    def available(self) -> str:
        """Return name, speed and turn of all segments that can be selected, for a message."""
        speed_m_s = self._scale * self._speed_m_s
        return ", ".join(
            f"{self._names[k]} ({speed_m_s[k]:.2f} m/s, {self._turn_rad_s[k]:.2f} rad/s)"
            for k in self._steady
        )

    def _next_of_mixture(self, speed_m_s: float, turn_rad_s: float) -> int:
        """Return the segment that the mixture owes most cycles; ten in a row contain them all."""
        direction = self._requested_direction(speed_m_s)
        options = self._segments_of_direction(direction)
        asked = np.array([speed_m_s, turn_rad_s])
        cycles, _ = self._mixtures[direction].best(asked)
        self._owed_cycles[options] += cycles
        part = options[cycles > 0]
        chosen = int(part[np.argmax(self._owed_cycles[part])])
        self._owed_cycles[chosen] -= CYCLES
        return chosen

    @cached_property
    def _mixtures(self) -> dict[int, Mixtures]:
        """Mixtures of the segments of each direction."""
        rates = np.column_stack([self._speed_m_s, self._turn_rad_s])
        options = {direction: self._segments_of_direction(direction) for direction in (1, 0, -1)}
        return {
            direction: Mixtures(rates[k], self._duration_s[k], self._slowest_m_s)
            for direction, k in options.items()
        }

    def _requested_direction(self, speed_m_s: float) -> int:
        """Return 1 forward, -1 backward, 0 at rest."""
        back_m_s = self._slowest_back_m_s
        if back_m_s == np.inf:  # none is recorded: as slow as forward
            back_m_s = self._slowest_m_s
        if speed_m_s >= 0.5 * self._slowest_m_s:
            return 1
        return -1 if speed_m_s <= -0.5 * back_m_s else 0

    def _segments_of_direction(self, direction: int) -> Indices:
        """Return the segments of a direction; else those that rest, else the slowest."""
        for sign in (direction, 0):
            options = self._steady[self._direction[self._steady] == sign]
            if len(options):
                return np.asarray(options)
        slowest = np.abs(self._speed_m_s[self._steady]).argmin()
        return self._steady[slowest : slowest + 1]
