"""What is planted in one of two simulated robots is named, and nothing where nothing is."""

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.loader import load_robot, load_run, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.run.deviation import Deviation
from snakewalk.controller.studies.shadow.diagnosis import (
    Cause,
    Goals,
    Signatures,
    answers,
    last_part,
)

JOINTS, HZ, SECONDS = 4, 50.0, 4.0


@pytest.fixture(scope="module")
def goals() -> Goals:
    """A wave through a short body."""
    robot = RobotConfig(name="short", joint_axes="y" * JOINTS, link_mass_kg=0.4)
    run = load_run("flat-slalom").model_copy(update={"cycle_hz": HZ, "physics_step_s": 0.005})
    due_s = np.arange(SECONDS * HZ) / HZ
    phase = 2.0 * np.pi * (0.5 * due_s[:, np.newaxis] - np.arange(JOINTS) / JOINTS)
    sent_rad = 0.5 * np.minimum(due_s, 1.0)[:, np.newaxis] * np.sin(phase)
    current_a = np.zeros_like(sent_rad)
    return last_part(run, robot, load_world("flat"), due_s, sent_rad, current_a, sent_rad)[0]


@pytest.fixture(scope="module")
def signatures(goals: Goals) -> Signatures:
    return Signatures(goals)


def at(count: int, index: int, value: float, rest: float = 0.0) -> Floats:
    values = np.full(count, rest)
    values[index] = value
    return values


def well(seed: int) -> dict[str, Floats | float]:
    """What differs between robots that are well: servos by 3 %, masses too, horns by half a degree.

    Friction differs by 5 %.
    """
    chance = np.random.default_rng(seed)
    return {
        "along": 1.0 + 0.05 * chance.standard_normal(),
        "across": 1.0 + 0.05 * chance.standard_normal(),
        "load_kg": 0.012 * chance.standard_normal(JOINTS + 1),
        "torque": 1.0 + 0.03 * chance.standard_normal(JOINTS),
        "slip_rad": 0.009 * chance.standard_normal(JOINTS),
    }


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("cause", "index", "key", "value"),
    [
        ("friction", None, "across", 1.7),
        ("load", 3, "load_kg", at(JOINTS + 1, 3, 0.15)),
        ("weaker servo", 2, "torque", at(JOINTS, 2, 0.6, 1.0)),
        ("slipped horn", 1, "slip_rad", at(JOINTS, 1, 0.25)),
    ],
)
def test_the_planted_cause_is_named(
    goals: Goals,
    signatures: Signatures,
    cause: Cause,
    index: int | None,
    key: str,
    value: Floats | float,
) -> None:
    robot = well(1)
    robot[key] = robot[key] * value if key in ("across", "torque") else robot[key] + value
    found = signatures.diagnose(answers(goals, Deviation(**robot)))  # type: ignore[arg-type]
    named = found.named
    assert named is not None
    assert (named.cause, named.at) == (cause, index)
    told = named.values[-1]
    if cause == "friction":  # a body of four joints hardly tells how much
        assert told > 1.1
    else:
        assert told == pytest.approx(np.min(value) if key == "torque" else np.max(value), rel=0.25)
    assert named.text(goals.robot) in found.text(goals.robot)


def test_a_robot_that_is_well_has_no_cause(goals: Goals, signatures: Signatures) -> None:
    found = signatures.diagnose(answers(goals, Deviation(**well(2))))  # type: ignore[arg-type]
    assert found.named is None
    assert found.text(goals.robot).startswith("nothing differs from the shadow")


def test_a_load_comes_on_top_of_a_head_with_cameras() -> None:
    robot = load_robot("alternating16-stereo")
    load_kg = at(robot.link_count, 3, 0.1)
    heavier = Deviation(load_kg=load_kg).robot(robot)
    np.testing.assert_allclose(
        heavier.link_masses_kg, np.array(robot.link_masses_kg) + load_kg, atol=1e-12
    )


@pytest.mark.slow
def test_a_host_that_computes_for_some_milliseconds_is_no_cause(
    goals: Goals, signatures: Signatures
) -> None:
    """On a port the goals are sent later after the read than by a simulated host."""
    late = signatures.diagnose(answers(goals, Deviation(), 0.004))
    assert late.named is None, late.text(goals.robot)
    weak = Deviation(torque=at(JOINTS, 2, 0.6, 1.0))
    named = signatures.diagnose(answers(goals, weak, 0.004)).named
    assert named is not None
    assert (named.cause, named.at) == ("weaker servo", 2)
