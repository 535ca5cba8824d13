"""A walk that gives way to the serpenoid while it is lost: variety first, then arriving."""

from dataclasses import replace

from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.walk.serpenoid import Serpentine
from snakewalk.controller.walk.walker import Walker

SERPENOID = -1
"""State of a decision that the fallback made."""


class Fallback:
    """Grows the walker's track, as the serpenoid between ``fall_back(True)`` and ``(False)``."""

    def __init__(self, walker: Walker) -> None:
        self._walker = walker
        self.track = walker.track
        self._serpentine = Serpentine(walker.track.points, track=walker.track)
        self._lost = False

    def fall_back(self, lost: bool) -> None:
        """Say whether the body has lost its way."""
        if lost and not self._lost:
            self._serpentine.take_over()
        self._lost = lost

    def decide(self, offset_rad: float, aim_rad: float) -> Decision:
        """Append the next piece of whichever is in force."""
        if not self._lost:
            return self._walker.decide(offset_rad, aim_rad)
        made = self._serpentine.decide(offset_rad, aim_rad)
        return replace(made, state=SERPENOID, visited=self._walker.visited)
