"""Cause that explains the differences between a robot's joints and those of its shadow.

For each possible fault (friction of the ground, a load on a link, a weaker servo, a slipped horn)
the simulator computes the change of angles and currents of all joints. A sound robot differs a
little in all of them, because no servo equals its data sheet; a fault differs much in one. The
causes are compared by their evidence, with the small differences of all others integrated out
(MacKay, "Information Theory, Inference, and Learning Algorithms", ch. 28).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.pool import each
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.run.deviation import NO_DEVIATION, Deviation
from snakewalk.controller.runlog.record import InitialPose, RunRecord
from snakewalk.controller.studies.shadow.shadow import Shadow

Cause = Literal["friction", "load", "weaker servo", "slipped horn"]
NAMED_FROM = 3.0
"""Least log ratio of a cause's evidence to a healthy robot's for naming it (ours)."""
_BIN_S = 0.1
"""Angles and currents are averaged over this, so that their steps average out (ours)."""
_CURRENT_STEP_A = 2.69e-3
_ANGLE_STEP_RAD = 1.5e-3
"""Units of the two: a step of the registers of most models."""
_CORRELATED_BINS = 4.0
"""Bins of noise that count as one: the model error is not white (ours)."""
_LEAST_NOISE = 1.0 / 12.0
"""Variance of a value that is rounded to whole steps, before averaging."""
_REFINEMENTS = 4
_LEAST_STEP = 0.01
"""Least change of ``faulty``: smaller ones have no effect (ours)."""
_REFINED_CAUSES = dict[Cause, int](friction=1, load=2) | {
    "weaker servo": 1,
    "slipped horn": 2,
}
"""Number of causes of each kind, those that explain most at first, that are followed on the
simulator (ours)."""
SETTLED_S = 1.0
"""Time from which on the shadow is compared: it begins at rest, wherever the robot was at
(ours)."""
MOST_S = 12.0
"""Length of the part that is looked at, the last one of the run (ours)."""
LEAST_S = 4.0
"""A shorter log is not sufficient (ours)."""
_DELAY_STEP_S = 0.005
_USUAL_DELAY_S = 0.005
"""Simulated delay of the goals, and its usual deviation between a read and a write (ours)."""


@dataclass(frozen=True, slots=True)
class Goals:
    """Goals sent to a chain, and its places then: the input of its shadow."""

    run: RunConfig
    robot: RobotConfig
    world: WorldConfig
    initial_pose: InitialPose
    since_start_s: Floats
    """(T,) when each cycle was due, from the first one."""
    sent_rad: Floats
    """(T, J) goals that were sent, rad."""


def is_gap(pause_s: float, run: RunConfig) -> bool:
    """Return whether bus watchdogs stop a chain whose cycles pause for this time."""
    return pause_s >= run.safety.watchdog_s and pause_s > 1.5 / run.cycle_hz


def last_part(
    run: RunConfig,
    robot: RobotConfig,
    world: WorldConfig,
    due_s: Floats,
    sent_rad: Floats,
    current_a: Floats,
    measured_rad: Floats,
) -> tuple[Goals, Floats]:
    """Return the last seconds of a run: its goals, and currents and angles (2, T, J) in them.

    They begin after the last pause of the cycles; the shadow starts where the joints were then.

    Args:
        run: the run.
        robot: its chain.
        world: a level floor: heading and place do not matter.
        due_s: (T,) when the cycles were due; one or more.
        sent_rad: (T, J) goals.
        current_a: (T, J) currents.
        measured_rad: (T, J) angles.

    """
    gaps = [k for k, pause_s in enumerate(np.diff(due_s), 1) if is_gap(float(pause_s), run)]
    first = max(len(due_s) - round(MOST_S * run.cycle_hz), gaps[-1] if gaps else 0)
    measured = np.stack([current_a, measured_rad])[:, first:]
    pose = InitialPose(run.start_heading_rad or 0.0, measured[1, 0])
    since_start_s = due_s[first:] - due_s[first]
    return Goals(run, robot, world, pose, since_start_s, sent_rad[first:]), measured


@dataclass(frozen=True, slots=True)
class NamedCause:
    """A cause, and how well it explains the difference."""

    cause: Cause
    at: int | None
    """Index of the joint, or of the loaded link; None for the ground."""
    evidence: float
    """Log ratio of the cause's evidence to a healthy robot's."""
    values: tuple[float, ...]
    """Factors on friction along and across; kg; factor on torque; rad."""

    def text(self, robot: RobotConfig) -> str:
        """Return the cause as a sentence."""
        if self.at is None:
            along, across = self.values
            return (
                f"the friction of the ground: {along:.2f} times the world's along the body, "
                f"{across:.2f} times across it"
            )
        value = self.values[0]
        if self.cause == "load":
            return f"a load: link {self.at} of the body (0 is the head) weighs {value:.2f} kg more"
        joint = robot.joint_label(self.at)
        if self.cause == "weaker servo":
            return f"a weaker servo: {joint} has {value:.2f} of its model's torque for a current"
        return f"a slipped horn: {joint} is bent by {value:+.2f} rad more than its servo says"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Causes of the differences, the best first, one of each kind; and the next joints."""

    causes: tuple[NamedCause, ...]
    residual_a: Floats
    """(J,) root mean square difference of the smoothed currents."""
    residual_rad: Floats
    """(J,) of the angles."""

    @property
    def named(self) -> NamedCause | None:
        """Cause that explains the difference; None if a healthy robot does as well."""
        best = self.causes[0] if self.causes else None
        return best if best is not None and best.evidence >= NAMED_FROM else None

    def text(self, robot: RobotConfig) -> str:
        """Return the cause as a sentence."""
        named = self.named
        most = int(np.argmax(self.residual_a))
        if named is None:
            return (
                "nothing differs from the shadow more than between robots that are well; most "
                f"does {robot.joint_label(most)}, by {self.residual_a[most]:.3f} A"
            )
        return (
            f"the difference from the shadow is explained by {named.text(robot)} "
            f"({self.probability:.0%} of the measured values)"
        )

    def evidence_over(self, cause: NamedCause) -> float:
        """Log ratio of the best cause's evidence to another's."""
        return self.causes[0].evidence - cause.evidence

    def to_dict(self, robot: RobotConfig) -> dict[str, object]:
        """Return the cause for JSON."""
        return {
            "named": None if self.named is None else self.named.cause,
            "at": None if self.named is None else self.named.at,
            "causes": [
                {
                    "cause": cause.cause,
                    "at": cause.at,
                    "values": [round(value, 4) for value in cause.values],
                    "log_evidence": round(cause.evidence, 2),
                    "text": cause.text(robot),
                }
                for cause in self.causes
            ],
            "residual_a": [round(float(value), 5) for value in self.residual_a],
            "residual_rad": [round(float(value), 5) for value in self.residual_rad],
        }

    @property
    def probability(self) -> float:
        """Probability of the best cause among all, with equal priors."""
        logs = np.array([cause.evidence for cause in self.causes])
        return float(1.0 / np.exp(logs - logs[0]).sum())


class Constants:
    """All possible differences as one vector: friction (2), loads (L), servos (J), slips (J)."""

    def __init__(self, robot: RobotConfig) -> None:
        links = robot.link_count
        joints = robot.joint_count
        self._links = links
        self._joints = joints
        mass_kg = robot.mean_link_mass_kg
        sizes = (2, links, joints, joints)

        def of_each(*values: float) -> Floats:
            return np.repeat(values, sizes)

        self.step = of_each(0.25, 0.5 * mass_kg, 0.3, 0.1)
        """Change of each value for a numerical derivative."""
        self.healthy = of_each(0.1, 0.03 * mass_kg, 0.05, 0.01)
        """Standard deviation among robots and grounds that are well (ours)."""
        self.faulty = of_each(0.5, 0.1 * mass_kg / 0.11, 0.5, 0.2)
        """Standard deviation of each value of a robot or ground that is at fault (ours)."""
        self.never_less = of_each(0, 1, 1, 0) > 0.0
        """Loads and weakness are one-sided."""
        self.causes: list[tuple[Cause, int | None, list[int]]] = [("friction", None, [0, 1])]
        first = 2
        kinds: tuple[tuple[Cause, int], ...] = (
            ("load", links),
            ("weaker servo", joints),
            ("slipped horn", joints),
        )
        for cause, count in kinds:
            self.causes += [(cause, k, [first + k]) for k in range(count)]
            first += count

    def deviation(self, values: Floats) -> Deviation:
        """Return the differences that a vector describes."""
        load_kg, weakness, slip_rad = np.split(values[2:], np.cumsum([self._links, self._joints]))
        return Deviation(
            along=max(1.0 + values[0], 0.05),
            across=max(1.0 + values[1], 0.05),
            load_kg=load_kg if load_kg.any() else None,
            torque=1.0 / (1.0 + weakness) if weakness.any() else None,
            slip_rad=slip_rad if slip_rad.any() else None,
        )

    def reported(self, cause: Cause, values: Floats) -> tuple[float, ...]:
        """Return the numbers of a cause as people say them."""
        if cause == "friction":
            return tuple(float(1.0 + value) for value in values)
        if cause == "weaker servo":
            return (float(1.0 / (1.0 + values[0])),)
        return (float(values[0]),)


def check_level(world: WorldConfig, *, in_water: bool = False) -> None:
    """Reject ground on which a shadow is meaningless.

    Args:
        world: the ground.
        in_water: whether a pool is accepted, too.

    Raises:
        InputError: it is not a level, open floor.

    """
    if in_water and world.ground.kind == "water":
        return
    if world.ground.kind != "flat" or world.obstacle is not None:
        raise InputError(
            f"world {world.name}: a shadow needs a level floor without obstacles; use a flat world"
        )


def goals_of(
    record: RunRecord, world: WorldConfig | None = None, *, in_water: bool = False
) -> tuple[Goals, Floats]:
    """Return a shadow's input and the measurements (2, T, J) of a log, up to a veto.

    In water they are those of the first seconds: the body begins at rest, as its shadow does.

    Args:
        record: the log.
        world: the chain's assumed ground; by default the log's.
        in_water: whether a pool is accepted, too.

    Raises:
        InputError: the log is too short, or the ground is not level.

    """
    header = record.header
    cycle = record.cycle
    world = header.world if world is None else world
    check_level(world, in_water=in_water)
    count = next((k for k, v in enumerate(cycle.verdict) if v == "veto"), len(cycle.verdict))
    if world.ground.kind == "water":
        count = min(count, round(MOST_S * header.run.cycle_hz))
    rows = (cycle.deadline_s, cycle.sent_rad, cycle.current_a, cycle.measured_rad)
    due_s, sent_rad, current_a, measured_rad = (row[:count] for row in rows)
    least = LEAST_S * header.run.cycle_hz
    if len(due_s) >= least:
        parts = (due_s, sent_rad, current_a, measured_rad)
        goals, measured = last_part(header.run, header.robot, world, *parts)
        if len(goals.since_start_s) >= least:
            return goals, measured
    raise InputError(
        f"the log has less than {LEAST_S:g} s without a pause, too little to find a cause; use "
        "a longer log"
    )


def answers(goals: Goals, deviation: Deviation, delay_s: float = 0.0) -> Floats:
    """Return currents in A and angles in rad (2, T, J) of a shadow; goals come ``delay_s`` late."""
    return answers_and_links(goals, deviation, delay_s)[0]


def answers_and_links(
    goals: Goals, deviation: Deviation, delay_s: float = 0.0
) -> tuple[Floats, Floats]:
    """Return the answers of a shadow, and its links (T, L, 3), m."""
    ground = build_ground(goals.world)
    shadow = Shadow(goals.run, goals.robot, goals.world, ground, goals.initial_pose, deviation)
    rows, joints = goals.sent_rad.shape
    out = np.empty((2, rows, joints))
    links_m = np.empty((rows, goals.robot.link_count, 3))
    for k, (due_s, sent_rad) in enumerate(zip(goals.since_start_s, goals.sent_rad, strict=True)):
        state = shadow.step(float(due_s), sent_rad, delay_s)
        out[0, k], out[1, k] = state.current_a, state.position_rad
        links_m[k] = body_in_world(goals.robot, shadow.head_pose(), state.position_rad).link_m
    return out, links_m


def diagnose(
    goals: Goals,
    measured: Floats,
    *,
    workers: int = 1,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Diagnosis:
    """Find the cause of differences between ``measured`` (2, T, J) and the shadow."""
    difference = features(goals, measured) - features(goals, answers(goals, NO_DEVIATION))
    if np.abs(difference).max() < 1.0:  # a step of the registers: there is nothing to explain
        return Diagnosis((), *_residuals(goals, difference))
    return Signatures(goals, workers=workers, on_progress=on_progress).diagnose(measured)


class Signatures:
    """Derivatives of the replies to goals by each possible cause.

    Args:
        goals: the goals that were sent.
        workers: processes that simulate.
        on_progress: called with the number of simulations done, and of all.

    """

    def __init__(
        self,
        goals: Goals,
        *,
        workers: int = 1,
        on_progress: Callable[[int, int], None] = lambda done, total: None,
    ) -> None:
        self._goals = goals
        self._constants = constants = Constants(goals.robot)
        count = len(constants.step) + 1
        self._plain = features(goals, answers(goals, NO_DEVIATION))
        work = partial(_answer, goals)
        columns: dict[int, Floats] = {}
        on_progress(0, count)
        indices = range(count)
        done = (
            ((k, work(k)) for k in indices)
            if workers <= 1
            else each(work, indices, workers=workers)
        )
        for k, answer in done:
            columns[k] = features(goals, answer) - self._plain
            on_progress(len(columns), count)
        # the delay of the host's goals is the last one; it is never a cause
        steps = np.append(constants.step, _DELAY_STEP_S)
        self._effects = np.stack([columns[k] for k in indices], axis=1) / steps
        self._healthy = np.append(constants.healthy, _USUAL_DELAY_S)

    def diagnose(self, measured: Floats) -> Diagnosis:
        """Describe the differences of measured currents and angles (2, T, J)."""
        difference = features(self._goals, measured) - self._plain
        constants = self._constants
        likely = self._likelihood([difference])
        first = [self._linear(likely, difference, parts) for _, _, parts in constants.causes]
        order = sorted(range(len(first)), key=lambda k: -first[k][0])
        well = likely.of(difference)
        refined = {}
        for cause, count in _REFINED_CAUSES.items():
            for k in [k for k in order if constants.causes[k][0] == cause][:count]:
                evidence, explained = first[k]
                worth = evidence > well
                parts = constants.causes[k][2]
                refined[k] = self._refined_cause(likely, difference, parts) if worth else explained
        # the residual of the best explanation is noise: it judges all of them
        likely = self._likelihood([difference, *(rest for _, rest, _ in refined.values())])
        well = likely.of(difference)
        named = []
        for k, (values, rest, slopes) in refined.items():
            cause, joint, parts = constants.causes[k]
            evidence = likely.cause(rest, slopes, values, constants.faulty[parts]) - well
            named.append(NamedCause(cause, joint, evidence, constants.reported(cause, values)))
        named.sort(key=lambda named_cause: -named_cause.evidence)
        return Diagnosis(tuple(named), *_residuals(self._goals, difference))

    def _likelihood(self, rests: Sequence[Floats]) -> "_Likelihood":
        """Likelihood with the noise that the best of some explanations leaves."""
        effects = self._effects
        spare = max(effects.shape[0] - effects.shape[1], 1)
        left = [rest - effects @ np.linalg.lstsq(effects, rest)[0] for rest in rests]
        noise = max(_LEAST_NOISE, min(float(residual @ residual) / spare for residual in left))
        return _Likelihood(effects, self._healthy, _CORRELATED_BINS * noise)

    def _linear(
        self, likely: "_Likelihood", difference: Floats, parts: list[int]
    ) -> tuple[float, tuple[Floats, Floats, Floats]]:
        """Log evidence of a cause with proportional effects; values, residuals, slopes."""
        constants = self._constants
        slopes = self._effects[:, parts]
        values = self._allowed_values(
            likely.best(difference, slopes, constants.faulty[parts]), parts
        )
        rest = difference - slopes @ values
        return likely.cause(rest, slopes, values, constants.faulty[parts]), (values, rest, slopes)

    def _refined_cause(
        self, likely: "_Likelihood", difference: Floats, parts: list[int]
    ) -> tuple[Floats, Floats, Floats]:
        """Values of a cause, their residuals and slopes, found on the simulator.

        Gauss-Newton steps; the slopes follow by Broyden's update.
        """
        constants = self._constants
        slopes = self._effects[:, parts]
        faulty = constants.faulty[parts]
        values = np.zeros(len(parts))
        changed = np.zeros(len(difference))
        best = (-math.inf, values, difference, slopes)
        for _ in range(_REFINEMENTS):
            target = difference - changed + slopes @ values
            step = self._allowed_values(likely.best(target, slopes, faulty), parts) - values
            if np.abs(step / faulty).max() < _LEAST_STEP:
                break
            values = values + step
            before = changed
            changed = self._changed_answers(parts, values)
            slopes = slopes + np.outer(changed - before - slopes @ step, step) / (step @ step)
            rest = difference - changed
            evidence = likely.cause(rest, slopes, values, faulty)
            if evidence > best[0]:
                best = (evidence, values, rest, slopes)
        return best[1:]

    def _allowed_values(self, values: Floats, parts: list[int]) -> Floats:
        """Return values where loads and weakness are not negative."""
        return np.where(self._constants.never_less[parts], np.maximum(values, 0.0), values)

    def _changed_answers(self, parts: list[int], values: Floats) -> Floats:
        vector = np.zeros(len(self._constants.step))
        vector[parts] = values
        return (
            features(self._goals, answers(self._goals, self._constants.deviation(vector)))
            - self._plain
        )


def features(goals: Goals, values: Floats) -> Floats:
    """Means over bins (B * 2 * J,) of currents and angles (2, T, J), in register steps."""
    hz = goals.run.cycle_hz
    each_bin = max(round(_BIN_S * hz), 1)
    rows = values[:, round(SETTLED_S * hz) :]
    bins = rows.shape[1] // each_bin
    means = rows[:, : bins * each_bin].reshape(2, bins, each_bin, -1).mean(axis=2)
    means = means / np.array([_CURRENT_STEP_A, _ANGLE_STEP_RAD])[:, np.newaxis, np.newaxis]
    return np.ascontiguousarray(means.transpose(1, 0, 2)).ravel()


def _residuals(goals: Goals, difference: Floats) -> tuple[Floats, Floats]:
    """Root mean squares (J,) in A and rad of a difference of features."""
    rms = np.sqrt((difference.reshape(-1, 2, goals.robot.joint_count) ** 2).mean(axis=0))
    return rms[0] * _CURRENT_STEP_A, rms[1] * _ANGLE_STEP_RAD


class _Likelihood:
    """Gaussian with small differences of all constants and noise integrated out.

    ``log N(x; 0, noise I + E diag(healthy^2) E^T)``, by Woodbury's identity.
    """

    def __init__(self, effects: Floats, healthy: Floats, noise: float) -> None:
        self._scaled = effects * healthy
        self._noise = noise
        inner = np.eye(effects.shape[1]) + self._scaled.T @ self._scaled / noise
        self._factor = np.linalg.cholesky(inner)
        self._log_det = 2.0 * float(np.log(np.diag(self._factor)).sum())

    def weigh(self, x: Floats) -> Floats:
        """Return the inverse covariance times ``x``."""
        inside = np.linalg.solve(self._factor, self._scaled.T @ x)
        back = np.linalg.solve(self._factor.T, inside)
        weighed: Floats = (x - self._scaled @ back / self._noise) / self._noise
        return weighed

    def of(self, x: Floats) -> float:
        """Return the log likelihood, up to a constant of the noise."""
        return -0.5 * float(x @ self.weigh(x)) - 0.5 * self._log_det

    def best(self, x: Floats, slopes: Floats, faulty: Floats) -> Floats:
        """Return the most probable values of a cause that changes the answers by slopes."""
        weighed = self.weigh(slopes)
        return np.asarray(
            np.linalg.solve(slopes.T @ weighed + np.diag(faulty**-2.0), weighed.T @ x)
        )

    def cause(self, rest: Floats, slopes: Floats, values: Floats, faulty: Floats) -> float:
        bend = slopes.T @ self.weigh(slopes) * np.outer(faulty, faulty) + np.eye(len(faulty))
        prior = -0.5 * float(((values / faulty) ** 2).sum())
        return self.of(rest) + prior - 0.5 * float(np.linalg.slogdet(bend)[1])


def _answer(goals: Goals, constant: int) -> Floats:
    constants = Constants(goals.robot)
    vector = np.zeros(len(constants.step))
    if constant == len(vector):
        return answers(goals, NO_DEVIATION, _DELAY_STEP_S)
    vector[constant] = constants.step[constant]
    return answers(goals, constants.deviation(vector))
