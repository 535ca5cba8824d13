"""A policy's file holds what was learnt, and refuses what cannot run."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world, shipped
from snakewalk.controller.motion.policy import (
    WAVE_ENDS,
    WAVE_SPAN,
    Policy,
    PolicyWave,
    load_policy,
    observation_names,
    save_policy,
)
from tests.helpers.drawn_policy import drawn_policy


def test_a_file_gives_the_policy_back(tmp_path: Path) -> None:
    policy = drawn_policy()
    save_policy(policy, tmp_path / "drawn.toml")
    again = load_policy(str(tmp_path / "drawn.toml"))
    assert again.model_dump(exclude={"network"}) == policy.model_dump(exclude={"network"})
    for held, given in zip(again.network, policy.network, strict=True):
        np.testing.assert_allclose(held.weights, given.weights, rtol=1e-5)
        np.testing.assert_allclose(held.bias, given.bias, rtol=1e-5)


def test_a_wave_of_numbers_is_cut_at_its_ends_and_keeps_their_order() -> None:
    assert len(PolicyWave().vector()) == len(WAVE_SPAN)
    for beyond, end in zip((-1e9, 1e9), WAVE_ENDS, strict=True):
        np.testing.assert_array_equal(PolicyWave.of(np.full(16, beyond)).vector(), end)
    values = PolicyWave().vector() + 0.01 * np.arange(16)
    np.testing.assert_allclose(PolicyWave.of(values).vector(), values, rtol=1e-5)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"network": ()}, "an observation a network"),
        ({"observation": ("one",)}, "layer 1: each row of weights has 1"),
        ({"wave": {"frequency_hz": 9.0}}, "frequency_hz"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, object], fault: str) -> None:
    with pytest.raises(ValueError, match=fault):
        Policy.model_validate(drawn_policy().model_dump() | change)


def test_a_network_runs_on_the_joints_that_it_observes() -> None:
    with pytest.raises(InputError, match=r"observes the joints of yaw16; robot alternating16"):
        drawn_policy().check(load_robot("alternating16"))
    with pytest.raises(InputError, match="nosuch: no such policy; shipped are wave-"):
        load_policy("nosuch")


@pytest.mark.parametrize("name", shipped("policies"))
def test_shipped_policies_say_where_they_come_from(name: str) -> None:
    policy = load_policy(name)
    assert policy.name == name
    assert policy.origin.steps > 10_000
    assert policy.origin.law == load_world(policy.origin.world).friction.law
    assert "snakewalk" in policy.origin.software
    assert policy.observation in {(), observation_names(load_robot(policy.robot))}
    assert policy.wave != PolicyWave() or policy.network
