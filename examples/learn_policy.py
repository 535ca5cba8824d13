"""Learn a policy by PPO: a small network that changes the wave of a snake as it goes.

Besides snakewalk[gym] it needs torch and stable-baselines3; the policy that it writes does not.

python examples/learn_policy.py --total-steps 100000 --out mine.toml
snakewalk gait policy run mine.toml
"""

import argparse
from importlib.metadata import version
from pathlib import Path

import gymnasium
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

import snakewalk.gym  # noqa: F401  registers the environment
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.motion.policy import (
    Layer,
    Origin,
    Policy,
    observation_names,
    save_policy,
)


class Saving(BaseCallback):
    """Writes the policy after each update, and prints what the last episodes have earned."""

    def __init__(self, given: argparse.Namespace) -> None:
        super().__init__()
        self._given = given

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        save_policy(learnt(self.model, self._given), self._given.out)

    def _on_rollout_end(self) -> None:
        earned = [each["r"] for each in self.model.ep_info_buffer][-8:]
        if earned:
            mean_m = sum(earned) / len(earned)
            print(f"{self.num_timesteps} steps: {mean_m:.2f} m an episode", flush=True)


def learnt(agent: PPO, given: argparse.Namespace) -> Policy:
    """The policy as it is now."""
    used = ("snakewalk", "stable_baselines3", "torch")
    origin = Origin(
        method="ppo",
        seed=given.seed,
        steps=agent.num_timesteps,
        world=given.world,
        law=load_world(given.world).friction.law_name,
        software=", ".join(f"{name} {version(name)}" for name in used),
    )
    return Policy(
        name=given.out.stem,
        robot=given.robot,
        observation=observation_names(load_robot(given.robot)),
        origin=origin,
        network=layers(agent),
    )


def layers(agent: PPO) -> tuple[Layer, ...]:
    """The network of the agent's mean action."""
    linear = [part for part in agent.policy.mlp_extractor.policy_net if hasattr(part, "weight")]
    return tuple(
        Layer(weights=part.weight.tolist(), bias=part.bias.tolist())
        for part in [*linear, agent.policy.action_net]
    )


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument(
        "--total-steps", type=int, default=100_000, help="of 20 ms, in all episodes together"
    )
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--robot", default="yaw16")
    options.add_argument("--world", default="flat")
    options.add_argument("--out", type=Path, default=Path("learnt.toml"))
    given = options.parse_args()
    torch.set_num_threads(1)  # one order of sums: a seed gives the same policy again
    made = {"robot": given.robot, "world": given.world}
    env = DummyVecEnv(
        [
            lambda: gymnasium.wrappers.RecordEpisodeStatistics(
                gymnasium.make("snakewalk/SnakeWave-v0", **made)
            )
        ]
    )
    agent = PPO(
        "MlpPolicy",
        VecNormalize(env, norm_obs=False),
        n_steps=1000,
        batch_size=125,
        n_epochs=10,
        learning_rate=5e-4,
        policy_kwargs={"net_arch": {"pi": [32, 32], "vf": [64, 64]}, "log_std_init": -0.7},
        seed=given.seed,
        device="cpu",
    )
    agent.learn(given.total_steps, callback=Saving(given))
    save_policy(learnt(agent, given), given.out)
    print(f"snakewalk gait policy run {given.out}")


if __name__ == "__main__":
    main()
