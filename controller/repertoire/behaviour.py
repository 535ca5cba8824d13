"""Behaviour of each body of a crowd ([YT] 5): its habit, flight, and avoidance of the others."""

from collections.abc import Sequence

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Indices, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.repertoire.crowd import Crowd
from snakewalk.controller.repertoire.habit import Habit
from snakewalk.controller.repertoire.secondary import SecondaryController
from snakewalk.controller.repertoire.segment import REVERSE
from snakewalk.controller.repertoire.separation import SeparatedCrowd
from snakewalk.controller.repertoire.species import Species, joined

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
SCHOOL_LENGTHS, FLIGHT_LENGTHS = 4.0, 3.0
"""Distances to neighbours of a school, and to bodies that are fled from, body lengths (ours)."""
REACH_LENGTHS = 0.6
"""Distance of the body's middle from food or prey that it has reached, body lengths (ours)."""
FOOD_BODIES = 4
"""Bodies that feed, for each piece of food (ours)."""
DEPTH_LENGTHS = 0.15
"""Least distance of a swimming body from surface and bottom, body lengths (ours)."""
PITCH_RAD, PITCH_FRAME_RAD = 0.5, 0.01
"""Steepest way up or down, and the largest change in a frame (ours)."""
_OFFSETS_RAD = np.array([0.0, 0.5, -0.5, 1.0, -1.0, 1.6, -1.6, 2.4, -2.4])


class Wandering:
    """Moves the bodies of several species; ``step`` goes on.

    Each has a secondary controller, so that bodies that go alike fall out of step. Everything is
    drawn from ``seed``.
    """

    def __init__(
        self,
        species: Sequence[Species],
        ground: HeightField,
        *,
        seed: int = 0,
        balance_rad: float = 0.005,
        separate: bool = True,
        surface_m: float = -np.inf,
    ) -> None:
        """Put the bodies at random places: those that swim below ``surface_m``, others on land.

        ``separate``: bodies never intersect, seen from above; else they pass through each other.

        Raises:
            InputError: no place is suitable, or the ground is too small for the bodies.

        """
        self._ground = ground
        self._surface_m = surface_m
        self._random = random = np.random.default_rng(seed)
        counts = [len(kind.sizes) for kind in species]
        count = sum(counts)
        self.species: Ints = np.repeat(np.arange(len(species)), counts)
        """(N,) number of each body's species."""
        self._habits = [kind.habit for kind in species]
        self.swims: Bools = np.repeat([kind.repertoire.swims for kind in species], counts)
        """(N,) whether a body swims."""
        self._hunts = np.repeat([habit is Habit.PURSUE for habit in self._habits], counts)
        sizes = np.concatenate([kind.sizes for kind in species])
        recorded_m = np.repeat([kind.repertoire.length_m for kind in species], counts)
        self.length_m: Floats = sizes * recorded_m
        """(N,) lengths of the bodies, m."""
        segments, radii = joined(species)
        self.radius_m: Floats = np.array(radii)[self.species]
        """(N, L) half the widths of the bodies at their links, over their sizes, m."""
        self.crowd = Crowd(segments, count, balance_rad=balance_rad)
        actions = [len(kind.repertoire.segments) for kind in species]
        self._first = np.repeat(np.cumsum([0, *actions[:-1]]), counts)
        controllers = [SecondaryController(kind.repertoire, patience=4) for kind in species]
        self._controllers = [
            controllers[kind].of_size(float(sizes[body]), seed + body)
            for body, kind in enumerate(self.species.tolist())
        ]
        fastest = [max(s.speed_m_s for s in kind.repertoire.segments) for kind in species]
        self.fastest_m_s: Floats = np.repeat(fastest, counts) * sizes
        """(N,) largest speeds of the bodies, m/s."""
        self._speed_m_s = random.uniform(0.4, 1.0, count) * self.fastest_m_s
        self.food_m: Floats = np.zeros((0, 3))
        """(F, 3) places of the food."""
        self.wish: tuple[float, float, float] | None = None
        """Speed, turn and climb of body 0 while a person steers it."""
        everybody = np.arange(count)
        self.goal_m: Floats = self._places(everybody)
        """(N, 3) goals of the bodies."""
        for kind, habit in enumerate(self._habits):
            if habit is Habit.SCHOOL:
                alike = self.species == kind
                self.goal_m[alike] = self.goal_m[alike][0]
        feeds = np.flatnonzero(np.array(self._habits)[self.species] == Habit.FEED)
        self.food_m = self._places(feeds[::FOOD_BODIES])
        self._pause = np.zeros(count, dtype=np.int64)
        self.reached: Ints = np.zeros(count, dtype=np.int64)
        """(N,) pieces of food or prey that each body has reached."""
        places = self._places(everybody)
        for body, (x, y, z) in enumerate(places.tolist()):
            start = Frame.flat(x, y, random.uniform(-np.pi, np.pi))
            action = self._action(body, float(self._speed_m_s[body]), 0.0)
            self.crowd.place(body, start, segment=action, scale=float(sizes[body]))
            self.crowd.origin_m[body, 2] = z
        self.crowd.stagger(seed)
        kinds = np.array([segment.kind for segment in segments.segments])
        of = np.repeat(np.arange(len(species)), actions)
        turns = np.isin(kinds, ["left", "right"])
        back = np.isin(kinds, REVERSE)
        self._parts = np.linspace(0, len(radii[0]) - 1, 5).astype(int)
        self._evasions = [
            [np.flatnonzero((of == k) & (main | turns)) for main in (back, kinds == "forward")]
            for k in range(len(species))
        ]
        """Actions of each species back, and onward."""
        self.separated = (
            SeparatedCrowd(self.crowd, self.radius_m, float(recorded_m.mean()))
            if separate
            else None
        )
        if self.separated is not None:
            self._spread(self.separated)

    def step(self, frames: int = 1) -> None:
        """Go on by ``frames`` frames of the repertoire."""
        swimmers = np.flatnonzero(self.swims)
        for _ in range(frames):
            if len(swimmers):
                self._pitch(swimmers)
            if self.separated is None:
                self.crowd.step()
                ended = np.flatnonzero(self.crowd.ended)
            else:
                moved = self.separated.step()
                ended = np.flatnonzero(self.crowd.ended & moved)
                self._evade(self.separated.held)
            if len(ended):
                self._decide(ended)

    def pilot(self, speed_m_s: float, turn_rad_s: float, climb_rad: float = 0.0) -> None:
        """Steer body 0 from now on, in place of its habit; ``climb_rad`` if it swims."""
        self.wish = speed_m_s, turn_rad_s, climb_rad
        self.crowd.interrupt(0, self._action(0, speed_m_s, turn_rad_s))

    def send(self, goal_m: Floats) -> None:
        """Send body 0 to a place (3,); there it continues with its habit."""
        self.wish = None
        self.goal_m[0] = goal_m
        self._pause[0] = 0

    def _action(self, body: int, speed_m_s: float, turn_rad_s: float) -> int:
        return int(self._first[body]) + self._controllers[body].choose(speed_m_s, turn_rad_s)

    def _pitch(self, bodies: Indices) -> None:
        """Turn swimming bodies up or down towards their goals ([YT] 3.2)."""
        crowd = self.crowd
        at_m = crowd.origin_m[bodies]
        margin_m = DEPTH_LENGTHS * self.length_m[bodies]
        bed_m = self._ground.elevation_m(at_m[:, 0], at_m[:, 1])
        to_m = self.goal_m[bodies] - at_m
        height_m = np.clip(at_m[:, 2] + to_m[:, 2], bed_m + margin_m, self._surface_m - margin_m)
        pitch_rad = np.arctan2(height_m - at_m[:, 2], np.hypot(to_m[:, 0], to_m[:, 1]))
        if self.wish is not None:
            pitch_rad[bodies == 0] = self.wish[2]
        axes = crowd.rotation[bodies].reshape(-1, 3, 3)
        x, y, z = axes.transpose(2, 0, 1)
        off = np.clip(pitch_rad, -PITCH_RAD, PITCH_RAD) - np.arcsin(np.clip(x[:, 2], -1.0, 1.0))
        turn = np.clip(off, -PITCH_FRAME_RAD, PITCH_FRAME_RAD)[:, None]
        turned = np.cos(turn) * x + np.sin(turn) * z, y, np.cos(turn) * z - np.sin(turn) * x
        crowd.rotation[bodies] = np.stack(turned, axis=2).reshape(-1, 9)
        within_m = np.clip(at_m[:, 2], bed_m + margin_m, self._surface_m - margin_m)
        crowd.origin_m[bodies, 2] = within_m

    def _spread(self, separated: SeparatedCrowd) -> None:
        """Give bodies that intersect other places until none does."""
        self.crowd.step()
        for _ in range(SPREADING_TRIES):
            bodies = separated.intersecting()
            if not len(bodies):
                return
            for body, place in zip(bodies.tolist(), self._places(bodies), strict=True):
                self.crowd.shift(body, place[:2] - self.crowd.origin_m[body, :2])
        raise InputError(
            f"crowd of {len(separated.held)} bodies: the ground is too small for them; use fewer"
        )

    def _evade(self, waiting_frames: Ints) -> None:
        """Let each body that has waited long begin another action, and go to another place."""
        late = np.flatnonzero((waiting_frames > 0) & (waiting_frames % WAITING_FRAMES == 0))
        if len(late):
            self.goal_m[late] = self._places(late)
        for body in late.tolist():
            behind = self.separated is not None and self.separated.met[body] > 0.5
            options = self._evasions[self.species[body]][int(behind)]
            self.crowd.interrupt(body, int(self._random.choice(options)))

    def _decide(self, bodies: Indices) -> None:
        """Choose the next action of bodies whose cycle has ended."""
        crowd = self.crowd
        speed_m_s = np.array([self.aim(body) for body in bodies.tolist()])
        heading = np.arctan2(crowd.rotation[bodies, 3], crowd.rotation[bodies, 0])
        rate_rad_s = self._turn_rad(bodies, crowd.origin_m[bodies, :2], heading) / TURNING_S
        rests = self._pause[bodies] > 0
        self._pause[bodies] -= rests
        speed_m_s[rests] = rate_rad_s[rests] = 0.0
        for body, speed, rate in zip(bodies.tolist(), speed_m_s, rate_rad_s, strict=True):
            asked = float(speed), float(rate)
            if body == 0 and self.wish is not None:
                asked = self.wish[:2]
            crowd.segment[body] = self._action(body, *asked)

    def aim(self, body: int) -> float:
        """Set the goal of a body, and return its wanted speed: flight goes before the habit."""
        habit = self._habits[self.species[body]]
        length_m = self.length_m[body]
        to_m = self.crowd.origin_m - self.crowd.origin_m[body]
        distance_m = np.hypot(to_m[:, 0], to_m[:, 1])
        distance_m[body] = np.inf
        prey_m = np.where(self._hunts, np.inf, distance_m)
        hunter_m = np.where(self._hunts, distance_m, np.inf)
        if habit is not Habit.PURSUE and hunter_m.min() < FLIGHT_LENGTHS * length_m:
            self.goal_m[body] = self.crowd.origin_m[body] - to_m[hunter_m.argmin()]
            return float(self.fastest_m_s[body])
        if habit is Habit.PURSUE and np.isfinite(prey_m.min()):
            self.goal_m[body] = self.crowd.origin_m[prey_m.argmin()]
            self._reach(body, float(prey_m.min()))
            return float(self.fastest_m_s[body])
        if habit is Habit.FEED:
            food_m = np.hypot(*(self.food_m - self.crowd.origin_m[body])[:, :2].T)
            nearest = int(food_m.argmin())
            self.goal_m[body] = self.food_m[nearest]
            if self._reach(body, float(food_m[nearest])):
                self.food_m[nearest] = self._places(np.array([body]))[0]
            return float(self._speed_m_s[body])
        goal_m = self.goal_m[body]
        arrived = np.hypot(*(goal_m - self.crowd.origin_m[body])[:2]) < length_m
        if arrived:
            goal_m = self._places(np.array([body]))[0]
            self._pause[body] = (self._random.random() < PAUSE_SHARE) * self._random.integers(3, 8)
        alike = self.species == self.species[body]
        self.goal_m[alike if habit is Habit.SCHOOL and arrived else body] = goal_m
        return float(self._speed_m_s[body])

    def _reach(self, body: int, distance_m: float) -> bool:
        """Count food or prey that a body has reached, and let it rest."""
        reached = distance_m < REACH_LENGTHS * float(self.length_m[body])
        if reached and self._pause[body] == 0:
            self.reached[body] += 1
            self._pause[body] = 4
        return reached

    def _turn_rad(self, bodies: Indices, origin_m: Floats, heading: Floats) -> Floats:
        """(n,) turn of each body: towards its goal, or the nearest free direction."""
        to = self.goal_m[bodies, :2] - origin_m
        for k, body in enumerate(bodies.tolist()):
            if self._habits[self.species[body]] is Habit.SCHOOL:
                to[k] += np.linalg.norm(to[k]) * self._pull(body)
        goal = np.arctan2(to[:, 1], to[:, 0])
        tried = goal[:, None] + _OFFSETS_RAD
        reach = AHEAD_LENGTHS * self.length_m[bodies]
        ahead = np.stack([np.cos(tried), np.sin(tried)], axis=2) * reach[:, None, None]
        free = self._safe(bodies, ahead + origin_m[:, None])
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

    def _pull(self, body: int) -> Floats:
        """(2,) pull of a school: the mean direction of the neighbours, and that to its middle."""
        crowd = self.crowd
        reach_m = SCHOOL_LENGTHS * self.length_m[body]
        to_m = crowd.origin_m[:, :2] - crowd.origin_m[body, :2]
        alike = self.species == self.species[body]
        near = alike & (np.linalg.norm(to_m, axis=1) < reach_m)
        ahead = crowd.rotation[near][:, [0, 3]].mean(axis=0)
        return np.asarray(ahead + 2.0 * to_m[alike].mean(axis=0) / reach_m)

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

    def _safe(self, bodies: Indices, points_m: Floats) -> Bools:
        """Which of points (n, ..., 2) are suitable for bodies (n,)."""
        x, y = points_m[..., 0], points_m[..., 1]
        depth_m = self._surface_m - self._ground.elevation_m(x, y)
        is_deep = depth_m > 3.0 * DEPTH_LENGTHS * self.length_m[bodies][:, None]
        is_land = (depth_m < 0.0) & (self._ground.slope_rad(x, y) < STEEP_RAD)
        suits = np.where(self.swims[bodies][:, None], is_deep, is_land)
        return self._ground.contains(x, y) & suits

    def _places(self, bodies: Indices) -> Floats:
        """(n, 3) a random place for each body, a tenth of the field from its edge.

        Raises:
            InputError: there is hardly any.

        """
        ground = self._ground
        places_m = np.zeros((len(bodies), 3))
        corner = ground.middle_m - 0.4 * np.array(ground.size_m)
        missing = np.arange(len(bodies))
        for _ in range(1000):
            tried = corner + self._random.random((len(missing), 2)) * 0.8 * np.array(ground.size_m)
            fits = self._safe(bodies[missing], tried[:, None])[:, 0]
            places_m[missing[fits], :2] = tried[fits]
            missing = missing[~fits]
            if not len(missing):
                break
        else:
            raise InputError(
                f"a ground that is nowhere under {STEEP_RAD:g} rad and dry, or nowhere deep "
                "enough to swim: no destination exists"
            )
        swims = self.swims[bodies]
        bed_m = ground.elevation_m(*places_m[swims, :2].T)
        share = self._random.uniform(0.25, 0.75, len(bed_m))
        places_m[swims, 2] = bed_m + share * (self._surface_m - bed_m)
        return places_m
