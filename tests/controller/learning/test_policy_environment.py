"""What is trained is what runs: the environment of policies steps the policy's own motion."""

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

import snakewalk.gym  # noqa: E402, F401
from snakewalk.config.loader import load_robot  # noqa: E402
from snakewalk.controller.learning.environment import SnakeEnvironment  # noqa: E402
from snakewalk.controller.learning.policy_environment import PolicyEnvironment  # noqa: E402
from snakewalk.controller.learning.wave_search import (  # noqa: E402
    episode_reward_m,
    search_progress,
    search_wave,
)
from snakewalk.controller.motion.policy import (  # noqa: E402
    WAVE_SPAN,
    PolicyWave,
    observation_names,
)
from tests.helpers.drawn_policy import drawn_policy  # noqa: E402

STEPS = 120


def test_a_policy_earns_in_training_what_it_earns_as_a_motion() -> None:
    policy = drawn_policy()
    env = PolicyEnvironment(policy)
    observation, _ = env.reset(seed=3)
    assert observation.dtype == np.float32
    earned_m = 0.0
    for _ in range(STEPS):
        assert observation in env.observation_space
        values = observation.astype(float)
        for layer in policy.network[:-1]:
            values = np.tanh(np.array(layer.weights) @ values + layer.bias)
        action = np.array(policy.network[-1].weights) @ values + policy.network[-1].bias
        observation, reward, tripped, _, info = env.step(action.astype(np.float32))
        earned_m += reward
        assert not tripped
    assert info["x_m"] != 0.0
    # the network's inputs and outputs are float32 here, and an encoder's step is 1.5 mrad
    ran_m = episode_reward_m(SnakeEnvironment(), policy, seed=3, steps=STEPS)
    assert earned_m == pytest.approx(ran_m, abs=2e-3)


def test_it_keeps_gymnasiums_form() -> None:
    env = gymnasium.make("snakewalk/SnakeWave-v0")
    assert env.unwrapped.observation_names == observation_names(load_robot("yaw16"))
    assert env.observation_space.shape == (36,)
    assert env.action_space.shape == WAVE_SPAN.shape
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.unwrapped.step(np.zeros(16, dtype=np.float32))
    with pytest.raises(gymnasium.error.ResetNeeded):
        _ = SnakeEnvironment().view


@pytest.mark.slow
def test_a_search_gives_the_same_wave_for_the_same_seed() -> None:
    pytest.importorskip("cma")

    def search() -> PolicyWave:
        progress = search_progress(robot="yaw16", world="flat", population=4, steps=25, seed=5)
        found = search_wave("tiny", progress, generations=1, workers=1)
        assert (found.origin.steps, found.origin.method) == (4 * 25, "cma")
        return found.wave

    found = search()
    assert found == search()
    assert found != PolicyWave()
