"""The secondary controller ([YT] 5.1): from a requested speed and turn to a segment."""

import numpy as np

from snakewalk.controller.repertoire.repertoire import Repertoire

STRAIGHT = ("forward", "reverse", "rest")
"""Kinds that are told apart by their speed."""


class SecondaryController:
    """Picks segments, and recommends another one when one has been repeated too long."""

    def __init__(
        self,
        repertoire: Repertoire,
        *,
        scale: float = 1.0,
        patience: int | None = 6,
        seed: int = 0,
    ) -> None:
        """Take actions for a body of ``scale`` times the recorded size.

        ``patience``: cycles of one segment after which it changes, 1 or more; None: never.

        Raises:
            ValueError: ``patience`` below 1, or no segment that goes forward.

        """
        if patience is not None and patience < 1:
            raise ValueError("a patience of at least one cycle")
        segments = repertoire.segments
        self._kinds = np.array([segment.kind for segment in segments])
        if "forward" not in self._kinds:
            raise ValueError("a repertoire without a forward segment")
        self._straight = np.flatnonzero(np.isin(self._kinds, STRAIGHT))
        self._steady = np.flatnonzero(self._kinds != "brake")
        brakes = np.flatnonzero(self._kinds == "brake")
        self._brake = int(brakes[0]) if len(brakes) else None
        self._speed_m_s = scale * np.array([segment.speed_m_s for segment in segments])
        self._turn_rad_s = np.array([segment.turn_rad_s for segment in segments])
        self._patience = patience
        self._random = np.random.default_rng(seed)
        self._last: int | None = None
        self._repeats = 0

    def nearest(self, speed_m_s: float, turn_rad_s: float = 0.0) -> int:
        """Nearest segment: by turn, and by speed where no turn is nearer than straight on.

        A negative speed goes back, one near nought rests, where such actions were recorded.
        """
        off = np.abs(self._turn_rad_s[self._steady] - turn_rad_s)
        nearest = int(self._steady[np.argmin(off)])
        if nearest not in self._straight:
            return nearest
        off = np.abs(self._speed_m_s[self._straight] - speed_m_s)
        return int(self._straight[np.argmin(off)])

    def choose(self, speed_m_s: float, turn_rad_s: float = 0.0) -> int:
        """As ``nearest``, for the next cycle, by a brake where a body that goes shall rest.

        After ``patience`` equal ones a random other of the same kind follows, where there is one.
        """
        chosen = self.nearest(speed_m_s, turn_rad_s)
        if self._kinds[chosen] == "rest":
            goes = self._last is not None and self._kinds[self._last] not in {"brake", "rest"}
            if goes and self._brake is not None:
                chosen = self._brake
        elif chosen == self._last and self._patience is not None:
            others = np.flatnonzero(self._kinds == self._kinds[chosen])
            others = others[others != chosen]
            if self._repeats >= self._patience and len(others):
                chosen = int(self._random.choice(others))
        self._repeats = self._repeats + 1 if chosen == self._last else 1
        self._last = chosen
        return chosen
