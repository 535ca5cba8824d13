"""Friction of the belly, along and across (and backward), and mass, from logs of a robot's runs.

The simulator follows a log's goals with other frictions until its body goes and turns as the
measured one did, and its joints need the measured currents. The motion on a level floor depends on
the ratio of the frictions alone: without inertia their common factor cancels. The currents give
that factor, as accurately as the servos' torque for a current is known. Other differences of robots
(masses, servos, horns) are fitted as well, with priors from the robot's file. Gauss-Newton's steps
give the most probable values, and the curvature there gives the intervals (Laplace's
approximation).

The mass is fitted on demand, from runs in which pitch joints lift: lifting needs current, and
friction has little effect on it. Without lifts weight and friction act together only.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.friction_law import LawName
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig, Water, WorldConfig
from snakewalk.controller.console.pool import each
from snakewalk.controller.run.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.studies.shadow.diagnosis import (
    SETTLED_S,
    Constants,
    Goals,
    answers_and_links,
    features,
    goals_of,
)

RATIO = "across_over_along"
MASS = "mass"
_LIFTING_RAD = 0.1
"""Pitch joints that turn less in a log lift nothing (ours)."""
WINDOW_S = 1.0
"""Length of a window in which motions are compared (ours)."""
MOVED_M = 0.02
"""A body that moves less in all windows gives no friction estimate (ours)."""
_FLOORS = (1.0, 1.0, 1e-3**2, 2e-3**2)
"""Least variance of the model error: currents and angles (register steps), displacement (m) and
turn (rad) of a window (ours)."""
_PER_SAMPLE = (40.0, 40.0, 4.0, 4.0)
"""Values of each kind that count as one, those of 4 s: model errors repeat with each cycle of a
gait (ours)."""
_PRIOR = 1.5
"""Prior standard deviation of a friction's logarithm: a factor of 4.5 (ours)."""
_COMMON = 0.05
"""Prior of the common torque for a current: the data sheet's tolerance (ours)."""
_STEP = 0.1
"""Change of the logarithms for a numerical derivative (ours)."""
_LONGEST_STEP = 0.7
"""Longest step of a logarithm: a factor of two (ours)."""
_STEPS_ALONE = 4
_STEPS_TOGETHER = 2
"""Steps with friction alone, then with all differences of robots (ours)."""
_DETERMINED_SIGMA = 0.35
"""Standard deviation of a logarithm from which a friction is undetermined: 95 % reach from half to
twice the value (ours)."""
_NORMAL_95 = 1.96


_MOST_STEPS = 12
_CONVERGED_STEP = 0.01
"""Steps with friction alone when laws are compared, and the step that ends them: a law that is not
fitted to the end seems to be wrong (ours)."""
_REPORTED_CORRELATION = 0.9
"""Correlation of two errors from which they are reported (ours)."""
Resistance = FrictionConfig | Water
"""Part of a world that resists a body: the friction of a floor, or the water."""


def resistance_of(world: WorldConfig) -> tuple[Resistance, tuple[str, ...]]:
    """Return the friction or the water of a world, and the names of its constants to identify."""
    water = world.ground
    if isinstance(water, Water):
        linear = ("linear_along_m_s", "linear_across_m_s")
        some = [name for name in linear if getattr(water, name) > 0.0]
        return water, ("drag_along", "drag_across", *some)
    back = [] if world.friction.back is None else ["back"]
    return world.friction, ("along", "across", *back)


def with_resistance(world: WorldConfig, part: Resistance) -> WorldConfig:
    """Return a world with another friction or water."""
    return world.model_copy(update={"ground" if isinstance(part, Water) else "friction": part})


@dataclass(frozen=True, slots=True)
class FrictionLog:
    """Data of a log for the fit: goals, replies, and displacements of the body."""

    goals: Goals
    answers: Floats
    """(2, T, J) currents in A, angles in rad."""
    motion: Floats
    """(W, 3) motion of each window: m ahead and to the left, rad turned."""

    @staticmethod
    def of(record: RunRecord, world: WorldConfig | None = None) -> "FrictionLog":
        """Extract the data from a run's log.

        Args:
            record: a run with a measured pose.
            world: the ground that it was on; the log's where it is None.

        Raises:
            InputError: the log does not allow a friction estimate, with the reason.

        """
        header = record.header
        pose = record.pose
        pose_kind = header.run.pose
        true = header.backend == "sim" and header.run.pose_is_true
        measured = pose_kind == "camera" or true
        if not measured:
            estimator = pose_kind or "the IMU or the joints"
            raise InputError(
                f"the pose of this run was estimated by {estimator}, which assumes the friction; "
                "use a run with a pose measured by a camera, or a simulated run"
            )
        goals, answered = goals_of(record, world, in_water=True)
        cycle = record.cycle
        stop = cycle.verdict.index("veto") if "veto" in cycle.verdict else None
        count = len(goals.since_start_s)
        is_start = goals.world.ground.kind == "water"
        time_s = cycle.time_s[:stop][slice(count) if is_start else slice(-count, None)]
        is_known = np.isfinite(pose.links_m).all(axis=(1, 2))
        pose_s = pose.time_s[is_known]
        if not ((pose_s < time_s[0] + WINDOW_S).any() and (pose_s > time_s[-1] - WINDOW_S).any()):
            raise InputError(
                "the log does not hold where the body was in its last seconds: friction is found "
                "from how it moves"
            )
        places = _places(pose.links_m[is_known])
        places_at_goals = np.stack(
            [np.interp(time_s, pose_s, column) for column in places.T], axis=1
        )
        motion = _motion(goals, places_at_goals)
        if np.hypot(motion[:, 0], motion[:, 1]).max() < MOVED_M:
            raise InputError(
                f"the body moves less than {1e3 * MOVED_M:g} mm in each second of the log, too "
                "little to identify friction; use the log of a run that travels"
            )
        return FrictionLog(goals, answered, motion)

    @staticmethod
    def simulated(
        goals: Goals,
        deviation: Deviation,
        observed: Callable[[Floats], Floats] = lambda links_m: links_m,
    ) -> "FrictionLog":
        """Return the log of a simulated robot.

        Args:
            goals: the sent goals.
            deviation: differences of the robot from its file and its world.
            observed: measurement of its links (T, L, 3).

        """
        answers, links_m = answers_and_links(goals, deviation)
        return FrictionLog(goals, answers, _motion(goals, _places(observed(links_m))))

    def vector(self) -> Floats:
        """All compared values (N,)."""
        return np.concatenate([features(self.goals, self.answers), self.motion.ravel()])

    def check_lifts(self) -> None:
        """Reject a log that does not allow a mass estimate.

        Raises:
            InputError: it lifts nothing; names a suitable run.

        """
        robot = self.goals.robot
        joints = list(robot.pitch_joints)
        if not joints:
            raise InputError(
                f"robot {robot.name}: has no pitch joints, so runs on a level floor depend on "
                "the product of weight and friction only; weigh the robot"
            )
        if np.ptp(self.answers[1][:, joints], axis=0).max() < _LIFTING_RAD:
            raise InputError(
                f"the pitch joints turn less than {_LIFTING_RAD:g} rad and lift nothing, so the "
                "mass cannot be identified; use the log of a gait that lifts the body "
                f"(snakewalk gait run sidewinding --robot {robot.name}, or rectilinear)"
            )

    def under(self, law: LawName) -> "FrictionLog":
        """Return the same log, of ground with a law of friction."""
        friction = self.goals.world.friction.model_copy(update={"law": law})
        return replace(self, goals=self.with_friction(friction))

    def with_friction(self, friction: Resistance) -> Goals:
        """Return the same goals on ground of another friction, or in other water."""
        return replace(self.goals, world=with_resistance(self.goals.world, friction))

    def errors(self, friction: Resistance) -> tuple[float, float]:
        """Root mean square error of displacement (m) and turn (rad) of a window with a friction."""
        again = FrictionLog.simulated(self.with_friction(friction), NO_DEVIATION)
        off = self.motion - again.motion
        way_m = math.sqrt(float((off[:, :2] ** 2).sum(axis=1).mean()))
        return way_m, math.sqrt(float((off[:, 2] ** 2).mean()))


@dataclass(frozen=True, slots=True)
class Found:
    """A number with its 95 % interval."""

    value: float
    low: float
    high: float

    @staticmethod
    def of_log(mean: float, deviation: float) -> "Found":
        """Convert a normal distribution of the logarithm."""
        reach = _NORMAL_95 * deviation
        return Found(math.exp(mean), math.exp(mean - reach), math.exp(mean + reach))

    def times(self, factor: float) -> "Found":
        """Return the evidence in another unit."""
        return Found(factor * self.value, factor * self.low, factor * self.high)

    @property
    def determined(self) -> bool:
        """Whether the interval is narrower than from half to twice the value."""
        return self.high < self.value * math.exp(_NORMAL_95 * _DETERMINED_SIGMA)


@dataclass(frozen=True, slots=True)
class FrictionFit:
    """Friction that makes the simulator move as the logs say."""

    friction: Resistance
    found: dict[str, Found]
    """Names of ``resistance_of``, and the ratio of the first two."""
    together: dict[str, float]
    """Correlation of pairs of errors that the logs hardly separate."""
    mass: Found | None = None
    """Mass of the spine's links over the robot's file; None if it was not estimated."""

    def world(self, world: WorldConfig) -> WorldConfig:
        """Return a world with this friction; undetermined values stay."""
        determined = [
            name for name, estimate in self.found.items() if estimate.determined and name != RATIO
        ]
        changes = {name: float(f"{getattr(self.friction, name):.4g}") for name in determined}
        part, _ = resistance_of(world)
        return with_resistance(world, part.model_copy(update=changes))

    def comment(self, paths: Sequence[Path]) -> list[str]:
        """Lines for the head of a world's file."""
        lines = [f"Friction found by `snakewalk robot identify` from {', '.join(map(str, paths))}:"]
        for name, estimate in self.found.items():
            note = "" if estimate.determined else "; not identified from these logs"
            lines.append(
                f"{name.replace('_', ' ')} {estimate.value:.4g}, 95 % of {estimate.low:.4g} to "
                f"{estimate.high:.4g}{note}"
            )
        return lines


def with_mass(robot: RobotConfig, share: float) -> RobotConfig:
    """Return the robot with the link masses of its spine times ``share``."""
    scaled_kg = [float(f"{share * mass_kg:.6g}") for mass_kg in robot.bare_link_masses_kg]
    return robot.with_link_masses(scaled_kg)


def fit_friction(
    logs: Sequence[FrictionLog],
    *,
    mass: bool = False,
    workers: int = 1,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> FrictionFit:
    """Find the friction of runs of one robot on one ground; begins with the first log's world.

    Args:
        logs: of one robot.
        mass: whether to find the mass of its links as well.
        workers: processes that simulate.
        on_progress: called with the number of simulations done, and of all.

    Raises:
        InputError: the mass is requested, and a log does not allow it.

    """
    if mass:
        for log in logs:
            log.check_lifts()
    return _Fit(logs, mass, workers, on_progress).run()


def friction_misfit(logs: Sequence[FrictionLog], on_progress: Callable[[int, int], None]) -> float:
    """Fit the friction alone; return the negative logarithm of the likelihood that is left."""
    return _Fit(logs, False, 1, on_progress).misfit()


class _Fit:
    """Gauss-Newton steps; the vector has the friction's logarithms, then other differences."""

    def __init__(
        self,
        logs: Sequence[FrictionLog],
        mass: bool,
        workers: int,
        on_progress: Callable[[int, int], None],
    ) -> None:
        self._logs = logs
        self._workers = workers
        self._on_progress = on_progress
        first = logs[0].goals
        resistance, frictions = resistance_of(first.world)
        self._start = np.log([getattr(resistance, name) for name in frictions] + [1.0] * mass)
        self._names = (*frictions, *[MASS] * mass)
        constants = Constants(first.robot)
        self._steps = constants.step[2:]
        kinds = np.concatenate([_kinds(log) for log in logs])
        measured = np.concatenate([log.vector() for log in logs])
        self._known = np.isfinite(measured)  # a servo may not report its current
        self._measured = measured[self._known]
        self._kinds = kinds[self._known]
        self._noise = np.array(_FLOORS)
        links = first.robot.link_count
        joints = first.robot.joint_count
        covariance = np.diag(constants.healthy[2:] ** 2)
        servos = slice(links, links + joints)
        covariance[servos, servos] += _COMMON**2
        k = len(self._names)
        self._prior = np.zeros((k + len(covariance), k + len(covariance)))
        self._prior[:k, :k] = np.eye(k) / _PRIOR**2
        self._prior[k:, k:] = np.linalg.inv(covariance)
        self._done = 0
        self._total = (_STEPS_ALONE + _STEPS_TOGETHER) * (k + 1) + 1 + len(covariance)

    def run(self) -> FrictionFit:
        k = len(self._names)
        values = np.concatenate([self._start, np.zeros(len(self._steps))])
        now = self._simulated(values)
        others = np.zeros((len(now), 0))
        for turn in range(_STEPS_ALONE + _STEPS_TOGETHER):
            if turn == _STEPS_ALONE:
                others = self._columns(values, now, range(k, len(values)), self._workers)
            effects = np.hstack([self._columns(values, now, range(k), 1), others])
            count = effects.shape[1]
            self._set_noise(self._measured - now, effects)
            curvature, pull = self._normal(effects, self._measured - now)
            away = values - np.concatenate([self._start, np.zeros(len(self._steps))])
            pull -= self._prior[:count, :count] @ away[:count]
            step = np.linalg.solve(curvature, pull)
            step *= min(1.0, _LONGEST_STEP / np.abs(step[:k]).max())
            values[:count] += step
            now = self._simulated(values)
        self._set_noise(self._measured - now, effects)
        curvature, _ = self._normal(effects, self._measured - now)
        return self._fit(values, np.asarray(np.linalg.inv(curvature)))

    def misfit(self) -> float:
        """As ``friction_misfit``."""
        k = len(self._names)
        values = self._start.copy()
        others = np.zeros(len(self._steps))
        now = self._simulated(np.append(values, others))
        for _ in range(_MOST_STEPS):
            effects = self._columns(np.append(values, others), now, range(k), 1)
            self._set_noise(self._measured - now, effects)
            curvature, pull = self._normal(effects, self._measured - now)
            pull -= self._prior[:k, :k] @ (values - self._start)
            step = np.linalg.solve(curvature, pull)
            values += step * min(1.0, _LONGEST_STEP / np.abs(step).max())
            now = self._simulated(np.append(values, others))
            if np.abs(step).max() < _CONVERGED_STEP:
                break
        square = (self._measured - now) ** 2
        misfit = 0.0
        for kind, (floor, per_sample) in enumerate(zip(_FLOORS, _PER_SAMPLE, strict=True)):
            of = square[self._kinds == kind]
            misfit += 0.5 * len(of) / per_sample * math.log(max(floor, float(of.mean())))
        return misfit

    def _fit(self, values: Floats, covariance: Floats) -> FrictionFit:
        def of(weights: Floats) -> Found:
            spread = math.sqrt(float(weights @ covariance @ weights))
            return Found.of_log(float(weights @ values), spread)

        unit_steps = np.eye(len(values))
        estimates = {name: of(unit_steps[i]) for i, name in enumerate(self._names)}
        mass = estimates.pop(MASS, None)
        if mass is not None:  # and what the links weigh more, each
            k = len(self._names)
            robot = self._logs[0].goals.robot
            unit_steps[k - 1, k : k + robot.link_count] = 1.0 / (robot.link_count * mass.value)
            unit_steps[k - 1, k : k + robot.link_count] /= robot.mean_link_mass_kg
            mass = of(unit_steps[k - 1])
        pairs = {}
        for i, second_name in enumerate(estimates):
            for j, other in enumerate(list(estimates)[:i]):
                size = math.sqrt(covariance[i, i] * covariance[j, j])
                pairs[f"{other}, {second_name}"] = float(covariance[i, j]) / size
        estimates[RATIO] = of(unit_steps[1] - unit_steps[0])
        resistance, _ = resistance_of(self._logs[0].goals.world)
        together = {
            names: correlation
            for names, correlation in pairs.items()
            if abs(correlation) > _REPORTED_CORRELATION
        }
        return FrictionFit(_friction(self._names, values, resistance), estimates, together, mass)

    def _simulated(self, values: Floats) -> Floats:
        out: Floats = _simulated(self._logs, self._names, values)[self._known]
        self._count()
        return out

    def _columns(self, values: Floats, now: Floats, which: range, workers: int) -> Floats:
        """Effects (N, len(which)) of some of the values, by differences."""
        steps = np.concatenate([np.full(len(self._names), _STEP), self._steps])
        work = partial(_changed_values, self._logs, self._names, values, steps)
        done = ((k, work(k)) for k in which) if workers <= 1 else each(work, which, workers=workers)
        columns = {}
        for k, changed in done:
            columns[k] = (changed[self._known] - now) / steps[k]
            self._count()
        return np.stack([columns[k] for k in which], axis=1)

    def _count(self) -> None:
        self._done += 1
        self._on_progress(self._done, self._total)

    def _weights(self) -> Floats:
        return np.asarray(1.0 / (self._noise * np.array(_PER_SAMPLE))[self._kinds])

    def _normal(self, effects: Floats, rest: Floats) -> tuple[Floats, Floats]:
        weighed = effects * self._weights()[:, np.newaxis]
        count = effects.shape[1]
        curvature: Floats = weighed.T @ effects + self._prior[:count, :count]
        return curvature, np.asarray(weighed.T @ rest)

    def _set_noise(self, rest: Floats, effects: Floats) -> None:
        curvature, _ = self._normal(effects, rest)
        taken = np.einsum("ni,ij,nj->n", effects, np.linalg.inv(curvature), effects)
        taken = taken * self._weights()
        for kind, floor in enumerate(_FLOORS):
            of = self._kinds == kind
            spare = max(float(of.sum() - taken[of].sum()), 1.0)
            self._noise[kind] = max(floor, float((rest[of] ** 2).sum()) / spare)


def _friction(names: Sequence[str], logs: Floats, resistance: Resistance) -> Resistance:
    values = np.clip(np.exp(logs[: len(names)]), 1e-3, 5.0)  # range that a world accepts
    friction_values = dict(zip(names, map(float, values), strict=True))
    return resistance.model_copy(
        update={name: value for name, value in friction_values.items() if name != MASS}
    )


def _simulated(logs: Sequence[FrictionLog], names: Sequence[str], values: Floats) -> Floats:
    """Answer and motion (N,) of all logs, simulated with these values."""
    friction = _friction(names, values, resistance_of(logs[0].goals.world)[0])
    others = np.concatenate([np.zeros(2), values[len(names) :]])
    deviation = Constants(logs[0].goals.robot).deviation(others)
    goals = [log.with_friction(friction) for log in logs]
    if MASS in names:
        share = math.exp(float(values[list(names).index(MASS)]))
        robot = with_mass(logs[0].goals.robot, share)
        goals = [replace(each_goals, robot=robot) for each_goals in goals]
    again = [FrictionLog.simulated(each_goals, deviation) for each_goals in goals]
    return np.concatenate([each_log.vector() for each_log in again])


def _changed_values(
    logs: Sequence[FrictionLog], names: Sequence[str], values: Floats, steps: Floats, which: int
) -> Floats:
    changed = values.copy()
    changed[which] += steps[which]
    return _simulated(logs, names, changed)


def _kinds(log: FrictionLog) -> Ints:
    """Which noise each value of a log's vector (N,) has."""
    joints = log.goals.robot.joint_count
    count = len(features(log.goals, log.answers))
    answers = np.tile(np.repeat([0, 1], joints), count // (2 * joints))
    return np.concatenate([answers, np.tile([2, 2, 3], len(log.motion))])


def _places(links_m: Floats) -> Floats:
    """Place of a body in plan (T, 3): its centre, m, and its heading."""
    half = links_m.shape[1] // 2
    front = links_m[:, :half, :2].mean(axis=1)
    rear = links_m[:, half:, :2].mean(axis=1)
    ahead = front - rear
    heading = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    return np.column_stack([links_m[:, :, :2].mean(axis=1), heading])


def _motion(goals: Goals, places: Floats) -> Floats:
    """Displacement and turn (W, 3) of each window, in the body's frame at its start."""
    hz = goals.run.cycle_hz
    edges = np.arange(round(SETTLED_S * hz), len(places), round(WINDOW_S * hz))
    first, last = places[edges[:-1]], places[edges[1:]]
    displacement_m, (c, s) = last[:, :2] - first[:, :2], (np.cos(first[:, 2]), np.sin(first[:, 2]))
    ahead = c * displacement_m[:, 0] + s * displacement_m[:, 1]
    left = c * displacement_m[:, 1] - s * displacement_m[:, 0]
    return np.column_stack([ahead, left, last[:, 2] - first[:, 2]])
