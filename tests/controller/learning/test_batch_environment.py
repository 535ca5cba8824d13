"""The vector environment: robots of a batch learn what a robot of ``SnakeEnvironment`` learns."""

import importlib.util

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

import snakewalk.gym  # noqa: E402
from snakewalk.config.errors import InputError  # noqa: E402
from snakewalk.controller.learning.batch_environment import SnakeBatchEnvironment  # noqa: E402
from snakewalk.controller.learning.environment import SnakeEnvironment  # noqa: E402
from tests.oracles.compiled_bodies import CompiledBodies  # noqa: E402


def test_robots_of_a_batch_move_as_one_on_a_bus_and_start_again() -> None:
    assert snakewalk.gym.register is gymnasium.register
    batch = SnakeBatchEnvironment(2, max_episode_steps=15, make_bodies=CompiledBodies)
    alone = SnakeEnvironment()
    first, _ = batch.reset(seed=4)
    begin, _ = alone.reset(seed=4)
    np.testing.assert_allclose(first[0, :16], begin[:16], atol=0.01)
    assert first.shape == batch.observation_space.shape
    rewards = np.zeros((2, 15))
    for k in range(15):
        action = (0.3 * np.sin(0.1 * k - 0.8 * np.arange(16))).astype(np.float32) * min(k / 8, 1.0)
        observation, rewards[0, k], terminated, *_ = alone.step(action)
        seen, found, ended, cut, infos = batch.step(np.stack([action, action]))
        rewards[1, k] = found[0]
        assert not terminated
        assert not ended.any()
        assert cut.all() == (k == 14)
    np.testing.assert_allclose(seen[0, :16], observation[:16], atol=0.02)
    assert rewards[1].sum() == pytest.approx(rewards[0].sum(), abs=0.003)
    assert infos["energy_j"].shape == (2,)
    seen, found, ended, cut, _ = batch.step(np.zeros((2, 16), np.float32))
    assert not cut.any()
    assert not found.any()
    assert np.abs(seen[:, :16]).max() <= 0.11  # new robots


def test_hills_and_a_missing_package_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="world random-10: is not a level, open floor"):
        SnakeBatchEnvironment(2, world="random-10", make_bodies=CompiledBodies)
    installed = importlib.util.find_spec
    monkeypatch.setattr(
        "snakewalk.config.extras.find_spec",
        lambda name: None if name in {"warp", "mujoco_warp"} else installed(name),
    )
    with pytest.raises(InputError, match=r"pip install 'snakewalk\[warp\]'"):
        gymnasium.make_vec("snakewalk/SnakeBatch-v0", num_envs=2)
