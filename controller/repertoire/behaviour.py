"""Behaviour of each body of a crowd ([YT] 5): it wanders over a ground and avoids the others."""

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Indices, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.repertoire.crowd import Crowd
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.secondary import SecondaryController
from snakewalk.controller.repertoire.segment import REVERSE
from snakewalk.controller.repertoire.separation import SeparatedCrowd

STEEP_RAD = 0.6
"""Slopes beyond are avoided (ours)."""
CLEAR_LENGTHS = 0.6
"""Clearance to the centre of another body, body lengths (ours)."""
CLEAR_SIDE_LENGTHS = 0.25
"""Clearance to head, middle and tail of bodies that do not intersect, body lengths (ours)."""
AHEAD_LENGTHS = 1.0
"""Distance that a body looks ahead (ours)."""
TURNING_S = 1.5
"""Time in which a body turns to its wanted direction (ours)."""
PAUSE_SHARE = 0.08
"""Share of arrivals after which a body rests for a while (ours)."""
WAITING_FRAMES = 24
"""Frames after which a body that another one blocks begins another action (ours)."""
SPREADING_TRIES = 200
"""Rounds in which bodies that intersect at the start move to other places (ours)."""
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
        radius_m: Floats | None = None,
    ) -> None:
        """Put bodies of lengths ``sizes`` (N,) times the recorded one's at random places.

        ``radius_m`` (L,) are half the widths of the recorded body at its links: bodies then never
        intersect. Without it they pass through each other.

        Raises:
            InputError: the ground is steep everywhere, or is too small for the bodies.

        """
        count = len(sizes)
        self._repertoire = repertoire
        self._ground = ground
        self._random = random = np.random.default_rng(seed)
        self.length_m = sizes * repertoire.length_m
        """(N,) lengths of the bodies, m."""
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
        kinds = np.array([segment.kind for segment in repertoire.segments])
        turns = np.isin(kinds, ["left", "right"])
        back = np.isin(kinds, REVERSE)
        self._parts = np.linspace(0, repertoire.segments[0].link_m.shape[1] - 1, 5).astype(int)
        self._back = np.flatnonzero(back | turns)
        self._onward = np.flatnonzero((kinds == "forward") | turns)
        self.separated = (
            None if radius_m is None else SeparatedCrowd(self.crowd, radius_m, repertoire.length_m)
        )
        if self.separated is not None:
            self._spread(self.separated)

    def step(self, frames: int = 1) -> None:
        """Go on by ``frames`` frames of the repertoire."""
        for _ in range(frames):
            if self.separated is None:
                self.crowd.step()
                ended = np.flatnonzero(self.crowd.ended)
            else:
                moved = self.separated.step()
                ended = np.flatnonzero(self.crowd.ended & moved)
                self._evade(self.separated.held)
            if len(ended):
                self._decide(ended)

    def _spread(self, separated: SeparatedCrowd) -> None:
        """Give bodies that intersect other places until none does."""
        self.crowd.step()
        for _ in range(SPREADING_TRIES):
            pairs = separated.intersecting()
            if not len(pairs):
                return
            bodies = np.unique(pairs[:, 0])
            for body, place in zip(bodies.tolist(), self._places(len(bodies)), strict=True):
                self.crowd.shift(body, place - self.crowd.origin_m[body, :2])
        raise InputError(
            f"crowd of {len(separated.held)} bodies: the ground is too small for them; use fewer"
        )

    def _evade(self, waiting_frames: Ints) -> None:
        """Let each body that has waited long begin another action, and go to another place."""
        late = np.flatnonzero((waiting_frames > 0) & (waiting_frames % WAITING_FRAMES == 0))
        if len(late):
            self._goal_m[late] = self._places(len(late))
        for body in late.tolist():
            behind = self.separated is not None and self.separated.met[body] > 0.5
            options = self._onward if behind else self._back
            self.crowd.interrupt(body, int(self._random.choice(options)))

    def _decide(self, bodies: Indices) -> None:
        """Choose the next action of bodies whose cycle has ended."""
        crowd = self.crowd
        random = self._random
        origin_m = crowd.origin_m[bodies, :2]
        near = np.hypot(*(self._goal_m[bodies] - origin_m).T) < self.length_m[bodies]
        there = bodies[near]
        self._goal_m[there] = self._places(len(there))
        self._pause[there] = (random.random(len(there)) < PAUSE_SHARE) * random.integers(
            3, 8, len(there)
        )
        heading = np.arctan2(crowd.rotation[bodies, 3], crowd.rotation[bodies, 0])
        turn = self._turn_rad(bodies, origin_m, heading)
        for k, body in enumerate(bodies):
            rests = self._pause[body] > 0
            self._pause[body] -= int(rests)
            speed = 0.0 if rests else float(self._speed_m_s[body])
            rate = 0.0 if rests else float(turn[k]) / TURNING_S
            crowd.segment[body] = self._controllers[body].choose(speed, rate)

    def _turn_rad(self, bodies: Indices, origin_m: Floats, heading: Floats) -> Floats:
        """(n,) turn of each body: towards its goal, or the nearest free direction."""
        to = self._goal_m[bodies] - origin_m
        goal = np.arctan2(to[:, 1], to[:, 0])
        tried = goal[:, None] + _OFFSETS_RAD
        reach = AHEAD_LENGTHS * self.length_m[bodies]
        ahead = np.stack([np.cos(tried), np.sin(tried)], axis=2) * reach[:, None, None]
        free = self._safe(ahead + origin_m[:, None])
        gap = self._gap_m(bodies, ahead + origin_m[:, None])
        if self.separated is None:
            free &= gap > CLEAR_LENGTHS * reach[:, None]
        else:
            gap = np.minimum(gap, self._gap_m(bodies, origin_m[:, None] + 0.5 * ahead)).astype(
                float
            )
            free &= gap > CLEAR_SIDE_LENGTHS * reach[:, None]
        widest = 0 if self.separated is None else gap.argmax(axis=1)
        first = np.where(free.any(axis=1), free.argmax(axis=1), widest)
        return wrap(tried[np.arange(len(bodies)), first] - heading)

    def _gap_m(self, bodies: Indices, ahead_m: Floats) -> Floats:
        """(n, directions) from points (n, directions, 2) to the nearest part of another body."""
        others = self.crowd.origin_m[:, None, :2]
        if self.separated is not None:
            others = self.crowd.points_m[:, :2, self._parts].transpose(0, 2, 1).astype(float)
        gap = np.full(ahead_m.shape[:2], np.inf)
        for part in range(others.shape[1]):
            to = np.linalg.norm(ahead_m[:, :, None] - others[None, None, :, part], axis=3)
            to[np.arange(len(bodies)), :, bodies] = np.inf
            gap = np.minimum(gap, to.min(axis=2))
        return gap

    def _safe(self, points_m: Floats) -> Bools:
        x, y = points_m[..., 0], points_m[..., 1]
        inside = self._ground.contains(x, y)
        return inside & (self._ground.slope_rad(x, y) < STEEP_RAD)

    def _places(self, count: int) -> Floats:
        """(count, 2) random places that are not steep, a tenth of the field from its edge.

        Raises:
            InputError: there is hardly any.

        """
        ground = self._ground
        places_m = np.zeros((0, 2))
        corner = np.array([ground.x0_m, ground.y0_m]) + 0.1 * np.array(ground.size_m)
        for _ in range(1000):
            if len(places_m) >= count:
                return places_m[:count]
            tried = corner + self._random.random((count + 8, 2)) * 0.8 * np.array(ground.size_m)
            places_m = np.concatenate([places_m, tried[self._safe(tried)]])
        raise InputError(f"a ground that is nowhere under {STEEP_RAD:g} rad: no destination exists")
