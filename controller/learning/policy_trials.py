"""Comparison of policies with gaits: speed and cost over seeds.

A seed draws heading, friction and supply, the same for all motions.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from snakewalk.config.archive import MOST_JSON_BYTES, read_bytes
from snakewalk.config.loader import shipped
from snakewalk.controller.console.pool import each
from snakewalk.controller.metrics.displacement import full_rate_span_s
from snakewalk.controller.metrics.effort import energy_track
from snakewalk.controller.metrics.verdict import RunVerdict
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.policy_motion import PolicyMotion
from snakewalk.controller.motion.stop_profile import STOP_S
from snakewalk.controller.run.factory import prepare_policy
from snakewalk.controller.run.kinds.gait_factory import is_gait, prepare_gait
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.kinds.source_run import SourceRun
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.studies.sweep_measure import varied

HEADING_SPREAD_RAD = 0.2
"""Largest difference of the start's heading from x (that of the environment's episodes)."""


@dataclass(frozen=True, slots=True)
class PolicyTrial:
    """One run."""

    motion: str
    """Name or file of a policy, a gait, or a set of its parameters."""
    world: str
    seed: int
    seconds: float


@dataclass(frozen=True, slots=True)
class PolicyTrialResult:
    """A run's numbers at full rate; NaN where it tripped."""

    speed_m_s: float
    """Speed of the centre of mass, along the straight line from its start to its end."""
    body_lengths_cycle: float
    energy_j_m: float
    """Electrical energy of the motors, integrated in every physics step, for a metre of it."""
    course_rad: float
    """Heading of the measured line; x is 0."""
    slowed_to: float
    """Lowest rate of derating."""
    verdict: RunVerdict

    @property
    def is_tripped(self) -> bool:
        """Whether safety stopped the run."""
        return self.verdict.failure == "safety"


def policy_trials(
    planned: Sequence[PolicyTrial], workers: int
) -> Iterator[tuple[PolicyTrial, PolicyTrialResult]]:
    """Run trials as they finish.

    Raises:
        InputError: no such policy, gait or world, or one that does not fit its robot.

    """
    for trial in {replace(trial, seed=0): trial for trial in planned}.values():
        _prepare(trial)  # refuses bad input first
    yield from each(measure_trial, planned, workers=workers)


def measure_trial(trial: PolicyTrial) -> PolicyTrialResult:
    """Run a trial, and return its numbers."""
    return _measured_trial(run_robot(RunRequest(_prepare(trial), stoppable=False)), trial.seconds)


def _prepare(trial: PolicyTrial) -> SourceRun | GaitRun:
    rng = np.random.default_rng(trial.seed)
    heading_rad = float(rng.uniform(-HEADING_SPREAD_RAD, HEADING_SPREAD_RAD))
    prepare = (
        prepare_gait if is_gait(trial.motion) or _is_parameter_set(trial.motion) else prepare_policy
    )
    prepared: SourceRun | GaitRun = prepare(
        trial.motion,
        world=trial.world,
        seconds=trial.seconds,
        seed=trial.seed,
        keys={"run.start_heading_rad": heading_rad},
    )
    return varied(prepared, rng)


def _is_parameter_set(motion: str) -> bool:
    """Whether a file is a set of a gait's parameters; any other one is read as a policy."""
    path = Path(motion)
    if path.suffix != ".toml" or motion in shipped("policies") or not path.is_file():
        return False
    lines = read_bytes(path, MOST_JSON_BYTES).decode("utf-8", "replace").splitlines()
    return any(line.partition("=")[0].strip() == "gait" for line in lines)


def _measured_trial(result: RunResult, seconds: float) -> PolicyTrialResult:
    record = result.record
    source = result.source
    outcome = result.outcome
    assert isinstance(source, GaitMotion | PolicyMotion)
    if outcome.tripped is not None:
        return PolicyTrialResult(*(math.nan,) * 4, outcome.least_rate, result.verdict)
    pose = record.pose
    ends_s = full_rate_span_s(float(pose.time_s[0]), float(pose.time_s[-1]), seconds)
    first, last = np.searchsorted(pose.time_s, ends_s)
    way_m = (pose.centre_m[last] - pose.centre_m[first])[:2]
    from_s, to_s = float(pose.time_s[first]), float(pose.time_s[last])
    distance_m = math.hypot(*way_m)
    speed_m_s = distance_m / (to_s - from_s)
    frequency_hz = source.cycles / (seconds + 0.5 * STOP_S)
    electrical_j, _ = energy_track(record).between(from_s, to_s)
    return PolicyTrialResult(
        speed_m_s,
        speed_m_s / frequency_hz / record.header.robot.length_m,
        electrical_j / distance_m,
        float(np.arctan2(way_m[1], way_m[0])),
        outcome.least_rate,
        result.verdict,
    )
