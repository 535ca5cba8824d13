"""The secondary controller ([YT] 5.1): from a requested speed or turn to a segment."""

import numpy as np

from snakewalk.controller.repertoire.repertoire import Repertoire


class SecondaryController:
    """Picks segments, and recommends another one when one has been repeated too long."""

    def __init__(self, repertoire: Repertoire, *, patience: int = 6, seed: int = 0) -> None:
        """``patience``: cycles of one segment after which it changes, 1 or more.

        Raises:
            ValueError: ``patience`` below 1, or no segment that goes forward.

        """
        if patience < 1:
            raise ValueError("a patience of at least one cycle")
        kinds = np.array([segment.kind for segment in repertoire.segments])
        self._forward = np.flatnonzero(kinds == "forward")
        if not len(self._forward):
            raise ValueError("a repertoire without a forward segment")
        self._speed_m_s = np.array([segment.speed_m_s for segment in repertoire.segments])
        self._turn_rad_s = np.array([segment.turn_rad_s for segment in repertoire.segments])
        self._patience = patience
        self._random = np.random.default_rng(seed)
        self._last: int | None = None
        self._repeats = 0

    def nearest(self, speed_m_s: float, turn_rad_s: float = 0.0) -> int:
        """Nearest segment: by turn, and by speed where no turn is nearer than straight on."""
        nearest = int(np.argmin(np.abs(self._turn_rad_s - turn_rad_s)))
        if nearest not in self._forward:
            return nearest
        off = np.abs(self._speed_m_s[self._forward] - speed_m_s)
        return int(self._forward[np.argmin(off)])

    def choose(self, speed_m_s: float, turn_rad_s: float = 0.0) -> int:
        """As ``nearest``, for the next cycle; after ``patience`` equal ones a random other.

        The other one is of the same kind where there is one: a body that goes straight on does not
        turn for a change.
        """
        chosen = self.nearest(speed_m_s, turn_rad_s)
        if chosen == self._last and self._repeats >= self._patience:
            alike = np.sign(np.round(self._turn_rad_s, 2)) == np.sign(
                np.round(self._turn_rad_s[chosen], 2)
            )
            if chosen in self._forward:
                alike = np.isin(np.arange(len(alike)), self._forward)
            others = np.flatnonzero(alike)
            others = others[others != chosen]
            if len(others):
                chosen = int(self._random.choice(others))
        self._repeats = self._repeats + 1 if chosen == self._last else 1
        self._last = chosen
        return chosen
