"""Learn a wave by trial and error: amplitude, rate and phase of a travelling wave, on the bus.

python examples/learn_wave.py --trials 60 --steps 250
"""

import argparse

import gymnasium
import numpy as np


def total_reward(env: gymnasium.Env, wave: np.ndarray, steps: int, seed: int) -> float:
    """How far one episode goes along x, in m, less its energy."""
    env.reset(seed=seed)
    amplitude, rate, phase = wave  # rad, rad/s, rad a joint
    limit_rad = env.unwrapped.limit_rad
    total = 0.0
    for step in range(steps):
        swell = min(step / 25, 1.0)  # half a second: safety clamps what is sudden
        angle = swell * amplitude * np.sin(rate * 0.02 * step - phase * np.arange(len(limit_rad)))
        _, reward, terminated, truncated, _ = env.step((angle / limit_rad).astype(np.float32))
        total += reward
        if terminated or truncated:
            break
    return total


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--trials", type=int, default=8)
    options.add_argument("--steps", type=int, default=100, help="steps of 20 ms in one episode")
    given = options.parse_args()
    rng = np.random.default_rng(0)
    env = gymnasium.make("snakewalk.gym:snakewalk/Snake-v0")
    best, most_m = np.array([0.2, 2.0, 0.5]), -np.inf
    for trial in range(given.trials):
        wave = best + rng.normal(size=3) * [0.1, 1.0, 0.15] * (trial > 0)
        wave = np.clip(wave, [0.05, 0.5, 0.2], [0.7, 6.0, 1.2])
        reward_m = total_reward(env, wave, given.steps, seed=trial)
        if reward_m > most_m:
            best, most_m = wave, reward_m
            print(f"trial {trial}: {most_m:.2f} m by a wave of {wave.round(2)}")


if __name__ == "__main__":
    main()
