"""The secondary controller ([YT] 5.1): from a requested speed and turn to a segment."""

from typing import Final

import numpy as np

from snakewalk.config.arrays import Indices
from snakewalk.config.errors import InputError
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.segment import SIDES

_ALIKE: Final = 0.1
"""Turns that differ by less than this share of the largest one count as equal (ours)."""
_FAR: Final = 0.25
"""A speed or turn that is off by more than this share of the largest one is far (ours)."""
_DIRECTIONS: Final = {1: "goes forward", -1: "goes backward", 0: "rests"}
_SIDES: Final = {1: " and turns left", -1: " and turns right", 0: ""}


class SecondaryController:
    """Selects segments, and another one when one has been repeated too often.

    A requested speed has a direction: forward, backward, or at rest, which is below half of the
    slowest recorded speed. A segment of another direction is selected only if this direction has
    none.
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
            ValueError: ``patience`` below 1.
            InputError: no segment goes forward.

        """
        if patience is not None and patience < 1:
            raise ValueError("a patience of at least one cycle")
        segments = repertoire.segments
        self._names = [segment.name for segment in segments]
        self._kinds = np.array([segment.kind for segment in segments])
        self._steady = np.flatnonzero(self._kinds != "brake")
        brakes = np.flatnonzero(self._kinds == "brake")
        self._brake = int(brakes[0]) if len(brakes) else None
        self._speed_m_s = scale * np.array([segment.speed_m_s for segment in segments])
        self._turn_rad_s = np.array([segment.turn_rad_s for segment in segments])
        moves = self._kinds != "rest"
        self._direction = np.where(moves, np.sign(self._speed_m_s), 0.0).astype(int)
        turns = np.isin(self._kinds, list(SIDES))
        self._side = np.where(turns, np.sign(self._turn_rad_s), 0.0).astype(int)
        steady_m_s = self._speed_m_s[self._steady]
        if not (self._direction[self._steady] > 0).any():
            raise InputError(
                f"repertoire of {repertoire.robot} on {repertoire.world}: no action goes forward "
                f"({self.available()}); record it on a ground with more friction across the body"
            )
        self._slowest_m_s = float(steady_m_s[self._direction[self._steady] > 0].min())
        back_m_s = -steady_m_s[self._direction[self._steady] < 0]
        self._slowest_back_m_s = float(back_m_s.min(initial=np.inf))
        self._fastest_m_s = float(np.abs(steady_m_s).max())
        self._least_turn_rad_s = float(np.abs(self._turn_rad_s[turns]).min(initial=np.inf))
        self._most_turn_rad_s = float(np.abs(self._turn_rad_s[turns]).max(initial=0.0))
        self._patience = patience
        self._random = np.random.default_rng(seed)
        self._last: int | None = None
        self._repeats = 0

    def nearest(self, speed_m_s: float, turn_rad_s: float = 0.0) -> int:
        """Return the nearest segment in the direction of the speed: by turn, then by speed."""
        options = self._going(self._requested_direction(speed_m_s))
        off = np.abs(self._turn_rad_s[options] - turn_rad_s)
        near = options[off <= off.min() + _ALIKE * self._most_turn_rad_s]
        return int(near[np.argmin(np.abs(self._speed_m_s[near] - speed_m_s))])

    def choose(self, speed_m_s: float, turn_rad_s: float = 0.0) -> int:
        """As ``nearest``, for the next cycle; a body that goes forward brakes before it rests.

        After ``patience`` equal ones a random other of the same kind and direction follows.
        """
        chosen = self.nearest(speed_m_s, turn_rad_s)
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

    def missing(self, speed_m_s: float, turn_rad_s: float) -> str:
        """Return the motion that is requested and that no segment has; empty if one has it."""
        direction = self._requested_direction(speed_m_s)
        side = self._requested_side(turn_rad_s)
        has = (self._direction == direction) & (self._side == side)
        return "" if has[self._steady].any() else _DIRECTIONS[direction] + _SIDES[side]

    def is_far(self, speed_m_s: float, turn_rad_s: float) -> bool:
        """Return whether speed or turn of the nearest segment differs much from the requested."""
        chosen = self.nearest(speed_m_s, turn_rad_s)
        off_m_s = abs(self._speed_m_s[chosen] - speed_m_s)
        off_rad_s = abs(self._turn_rad_s[chosen] - turn_rad_s)
        least_rad_s = max(self._most_turn_rad_s, abs(turn_rad_s))
        return bool(off_m_s > _FAR * self._fastest_m_s or off_rad_s > _FAR * least_rad_s)

    def text(self, segment: int) -> str:
        """Return name, speed and turn of a segment for a message."""
        speed_m_s, turn_rad_s = (
            round(float(rates[segment]), 2) + 0.0  # not -0
            for rates in (self._speed_m_s, self._turn_rad_s)
        )
        return f"{self._names[segment]} ({speed_m_s:.2f} m/s, {turn_rad_s:.2f} rad/s)"

    def available(self) -> str:
        """Return all segments that can be selected, for a message."""
        return ", ".join(self.text(int(segment)) for segment in self._steady)

    def _requested_direction(self, speed_m_s: float) -> int:
        """Return 1 forward, -1 backward, 0 at rest."""
        back_m_s = self._slowest_back_m_s
        if back_m_s == np.inf:  # none is recorded: as slow as forward
            back_m_s = self._slowest_m_s
        if speed_m_s >= 0.5 * self._slowest_m_s:
            return 1
        return -1 if speed_m_s <= -0.5 * back_m_s else 0

    def _requested_side(self, turn_rad_s: float) -> int:
        """Return 1 left, -1 right, 0 where straight on is as near as the gentlest turn."""
        least_rad_s = self._least_turn_rad_s
        if least_rad_s == np.inf:
            least_rad_s = 0.0
        turns = turn_rad_s != 0.0 and abs(turn_rad_s) >= 0.5 * least_rad_s
        return int(np.sign(turn_rad_s)) if turns else 0

    def _going(self, direction: int) -> Indices:
        """Return the segments of a direction; else those that rest, else the slowest."""
        for sign in (direction, 0):
            options = self._steady[self._direction[self._steady] == sign]
            if len(options):
                return np.asarray(options)
        slowest = np.abs(self._speed_m_s[self._steady]).argmin()
        return self._steady[slowest : slowest + 1]
