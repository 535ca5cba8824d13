"""The environment keeps Gymnasium's promises, and a step is what happens on the bus."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402

import snakewalk.gym  # noqa: E402
from snakewalk.config.errors import InputError  # noqa: E402
from snakewalk.config.loader import load_robot  # noqa: E402
from snakewalk.controller.learning.environment import SnakeEnvironment, _fill  # noqa: E402

SHIPPED = Path(__file__).resolve().parents[3] / "config" / "robots"
JOINTS, LIMIT_RAD = 16, np.array(load_robot("yaw16").limit_rad)


def wave(step: int) -> np.ndarray:
    """Goals of a wave that swells in half a second and travels to the tail."""
    phase = 5.0 * 0.02 * step - 0.8 * np.arange(JOINTS)
    goal_rad = 0.4 * min(step / 25, 1.0) * np.sin(phase)
    return (goal_rad / LIMIT_RAD).astype(np.float32)


@pytest.fixture(scope="module")
def env() -> SnakeEnvironment:
    return SnakeEnvironment()


def test_gymnasium_finds_nothing_wrong(tmp_path: Path) -> None:
    assert snakewalk.gym.register is gymnasium.register
    made = gymnasium.make("snakewalk/Snake-v0")
    assert made.spec is not None
    assert made.spec.max_episode_steps == 500
    short = tmp_path / "short.toml"  # the checker resets often, and few servos start sooner
    text = (SHIPPED / "yaw16.toml").read_text().replace('"yyyyyyyyyyyyyyyy"', '"yyy"')
    short.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(SnakeEnvironment(str(short)), skip_render_check=True)


def test_a_seed_repeats_an_episode_to_the_last_bit(env: SnakeEnvironment) -> None:
    def episode(seed: int) -> list[np.ndarray]:
        first, _ = env.reset(seed=seed)
        return [first, *(env.step(wave(k))[0] for k in range(20))]

    once, again, other = episode(3), episode(3), episode(4)
    np.testing.assert_array_equal(once, again)
    assert np.abs(once[0] - other[0]).max() > 0.01  # joints and heading start elsewhere


def test_reward_is_the_way_less_the_energy(env: SnakeEnvironment) -> None:
    observation, start = env.reset(seed=0)
    names = dict(zip(env.observation_names, range(len(observation)), strict=True))
    assert observation[names["heading_cos"]] == pytest.approx(1.0, abs=0.03)
    total, along_m = 0.0, 0.0
    for k in range(200):
        observation, reward, terminated, truncated, info = env.step(wave(k))
        assert observation in env.observation_space
        assert (terminated, truncated, info["tripped"]) == (False, False, None)
        total += reward
        along_m += 0.02 * observation[names["velocity_x_m_s"]]
    way_m = info["x_m"] - start["x_m"]
    assert way_m > 0.3  # it goes forward
    assert along_m == pytest.approx(way_m, abs=1e-4)
    assert info["energy_j"] > start["energy_j"]
    assert total == pytest.approx(way_m - 0.0005 * (info["energy_j"] - start["energy_j"]))
    lag = observation[names["sent_joint5_rad"]] - observation[names["measured_joint5_rad"]]
    assert 1e-3 < abs(lag) < 0.3  # servos, not a kinematic chain


def test_safety_stands_between_policy_and_servos(env: SnakeEnvironment) -> None:
    env.reset(seed=0)
    jump = np.full(JOINTS, 1.0, dtype=np.float32)
    observation, _, _, _, info = env.step(jump)
    assert info["clamped"] == list(range(JOINTS))
    sent = observation[env.observation_names.index("sent_joint0_rad")]
    assert sent < 0.3  # a rate that the servos keep
    broken = jump.copy()
    broken[3] = np.nan
    _, reward, terminated, _, info = env.step(broken)
    assert terminated
    assert reward < -0.9
    assert info["tripped"]
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(jump)
    env.reset(seed=0)
    assert env.step(wave(0))[2] is False


def test_what_cannot_be_is_told() -> None:
    with pytest.raises(InputError, match="no such robot"):
        SnakeEnvironment(robot="eel99")
    with pytest.raises(InputError, match="start_joint_rad"):
        SnakeEnvironment(start_joint_rad=9.0)
    with pytest.raises(InputError, match="physics_step_s"):
        SnakeEnvironment(physics_step_s=0.5)
    with pytest.raises(InputError, match="no options"):
        SnakeEnvironment().reset(options={"heading": 1.0})


@pytest.mark.parametrize("compiled", [True, False])
def test_an_observation_has_its_numbers_in_their_places(compiled: bool) -> None:
    rng = np.random.default_rng(5)
    fill = _fill if compiled else _fill.py_func  # type: ignore[attr-defined]
    end = np.concatenate([np.full(16, 3.0), np.ones(5), np.full(2, 3.0)]).astype("f4")
    for _ in range(20):
        position, velocity, current, sent = rng.normal(0.0, 2.0, (4, 4))
        # a body that winds up by more than a turn
        bend_rad = rng.uniform(-3.0, 3.0) + np.cumsum(rng.uniform(0.0, 3.0, 5))
        turns = Rotation.from_euler("z", bend_rad[:, None])
        rotation = (turns * Rotation.from_euler("y", 0.3)).as_matrix()
        values = np.empty_like(end)
        speed_m_s = rng.normal(0.0, 3.0, 2)
        fill(values, end, position, velocity, current, sent, rotation, speed_m_s)
        heading_rad = np.unwrap(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])).mean()
        told = [np.cos(heading_rad), np.sin(heading_rad), *speed_m_s]
        whole = np.concatenate([position, velocity, current, sent, rotation[0, 2], told])
        np.testing.assert_allclose(values, np.clip(whole, -end, end), atol=1e-6)
