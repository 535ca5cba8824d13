"""Behaviour of each body of a crowd ([YT] 5): it wanders over a ground and avoids the others."""

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Indices
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.repertoire.crowd import Crowd
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.secondary import SecondaryController

STEEP_RAD = 0.6
"""Slopes beyond are avoided (ours)."""
ROOM_LENGTHS = 0.6
"""Clearance to the centre of another body, body lengths (ours)."""
AHEAD_LENGTHS = 1.0
"""How far ahead a body looks (ours)."""
TURNING_S = 1.5
"""In which a body would turn to where it wants (ours)."""
PAUSE_SHARE = 0.08
"""Share of arrivals after which a body rests for a while (ours)."""
_OFFSETS_RAD = np.array([0.0, 0.5, -0.5, 1.0, -1.0, 1.6, -1.6, 2.4, -2.4])


class Wandering:
    """Sends N bodies of a ``Crowd`` to places of their own; ``step`` moves them on.

    Each has a secondary controller, so that bodies that go alike fall out of step. Everything is
    drawn from ``seed``.
    """

    def __init__(
        self,
        repertoire: Repertoire,
        ground: HeightField,
        sizes: Floats,
        *,
        seed: int = 0,
        balance_rad: float = 0.005,
    ) -> None:
        """Put bodies of lengths ``sizes`` (N,) times the recorded one's at random places."""
        count = len(sizes)
        self._repertoire, self._ground = repertoire, ground
        self._random = random = np.random.default_rng(seed)
        self.length_m = sizes * repertoire.length_m
        """(N,)"""
        self.crowd = Crowd(repertoire, count, balance_rad=balance_rad)
        self._controllers = [
            SecondaryController(repertoire, scale=float(size), patience=4, seed=seed + k)
            for k, size in enumerate(sizes)
        ]
        fastest = max(segment.speed_m_s for segment in repertoire.segments)
        self._speed_m_s = random.uniform(0.4, 1.0, count) * fastest * sizes
        self._goal_m = self._places(count)
        self._pause = np.zeros(count, dtype=np.int64)
        for body, (x, y) in enumerate(self._places(count)):
            start = Frame.flat(x, y, random.uniform(-np.pi, np.pi))
            action = self._controllers[body].choose(float(self._speed_m_s[body]))
            self.crowd.place(body, start, segment=action, scale=float(sizes[body]))
        self.crowd.stagger(seed)

    def step(self, frames: int = 1) -> None:
        """Go on by ``frames`` frames of the repertoire."""
        for _ in range(frames):
            self.crowd.step()
            ended = np.flatnonzero(self.crowd.ended)
            if len(ended):
                self._decide(ended)

    def _decide(self, bodies: Indices) -> None:
        """Choose the next action of bodies whose cycle has ended."""
        crowd, random = self.crowd, self._random
        at = crowd.origin_m[bodies, :2]
        near = np.hypot(*(self._goal_m[bodies] - at).T) < self.length_m[bodies]
        there = bodies[near]
        self._goal_m[there] = self._places(len(there))
        self._pause[there] = (random.random(len(there)) < PAUSE_SHARE) * random.integers(
            3, 8, len(there)
        )
        heading = np.arctan2(crowd.rotation[bodies, 3], crowd.rotation[bodies, 0])
        turn = self._turn_rad(bodies, at, heading)
        for k, body in enumerate(bodies):
            rests = self._pause[body] > 0
            self._pause[body] -= int(rests)
            speed = 0.0 if rests else float(self._speed_m_s[body])
            rate = 0.0 if rests else float(turn[k]) / TURNING_S
            crowd.segment[body] = self._controllers[body].choose(speed, rate)

    def _turn_rad(self, bodies: Indices, at: Floats, heading: Floats) -> Floats:
        """(n,) turn of each body: towards its goal, or the nearest free direction."""
        to = self._goal_m[bodies] - at
        goal = np.arctan2(to[:, 1], to[:, 0])
        tried = goal[:, None] + _OFFSETS_RAD
        reach = AHEAD_LENGTHS * self.length_m[bodies]
        ahead = np.stack([np.cos(tried), np.sin(tried)], axis=2) * reach[:, None, None]
        ahead += at[:, None]
        free = self._safe(ahead)
        others = self.crowd.origin_m[:, :2]
        gap = np.linalg.norm(ahead[:, :, None] - others[None, None], axis=3)
        gap[np.arange(len(bodies)), :, bodies] = np.inf
        free &= gap.min(axis=2) > ROOM_LENGTHS * reach[:, None]
        first = np.where(free.any(axis=1), free.argmax(axis=1), 0)
        return wrap(tried[np.arange(len(bodies)), first] - heading)

    def _safe(self, points_m: Floats) -> Bools:
        x, y = points_m[..., 0], points_m[..., 1]
        inside = self._ground.contains(x, y)
        return np.asarray(inside & (self._ground.slope_rad(x, y) < STEEP_RAD))

    def _places(self, count: int) -> Floats:
        """(count, 2) random places that are not steep, a tenth of the field from its edge.

        Raises:
            InputError: there is hardly any.

        """
        ground, found = self._ground, np.zeros((0, 2))
        corner = np.array([ground.x0_m, ground.y0_m]) + 0.1 * np.array(ground.size_m)
        for _ in range(1000):
            if len(found) >= count:
                return found[:count]
            tried = corner + self._random.random((count + 8, 2)) * 0.8 * np.array(ground.size_m)
            found = np.concatenate([found, tried[self._safe(tried)]])
        raise InputError(f"a ground that is nowhere under {STEEP_RAD:g} rad: no place to go to")
