"""Benchmark: a policy of LeRobot learns a gait from 20 recorded episodes, and drives the robot.

Run it in the environment of ``make lerobot``::

    .venv-lerobot/bin/python examples/lerobot/train_policy.py

A child process simulates the robot on a flat floor by wall time. ``lerobot-record`` records the
gait teleoperator, and an ACT policy without images learns its action chunks. Teleoperator and
policy then each drive a robot from rest. The script prints distances and joint amplitudes.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import numpy as np
import torch
from lerobot.configs.types import FeatureType, NormalizationMode, PolicyFeature
from lerobot.datasets.lerobot_dataset import LeRobotDataset, LeRobotDatasetMetadata
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors
from lerobot.scripts import lerobot_record
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_STATE
from lerobot.utils.import_utils import register_third_party_plugins

import snakewalk as sw
from lerobot_robot_snakewalk import Snakewalk, SnakewalkConfig, SnakewalkGait, SnakewalkGaitConfig

ROBOT, WORLD, REPO = "yaw16", "flat", "snakewalk/gait"
FPS = 20
CHUNK = 20
"""Actions that the policy predicts at once: 1 s."""
EACH = 10
"""Actions that are executed before the next prediction."""
BATCH = 64
Act = Callable[[dict[str, Any]], dict[str, float]]


@contextmanager
def simulated() -> Iterator[tuple[sw.RealTimeRobot, Snakewalk]]:
    """Return a body at rest, and LeRobot's robot on its port, with torque on."""
    robot, world = sw.load_robot(ROBOT), sw.load_world(WORLD)
    with sw.RealTimeRobot(robot, world) as body:
        snake = Snakewalk(SnakewalkConfig(port=body.path, id="snake"))
        with snake:
            yield body, snake


def record(root: Path, episodes: int, seconds: float) -> None:
    """Record episodes of the gait teleoperator with ``lerobot-record``."""
    with sw.RealTimeRobot(sw.load_robot(ROBOT), sw.load_world(WORLD)) as body:
        words = [
            *("lerobot-record", "--robot.type=snakewalk", f"--robot.port={body.path}"),
            *("--robot.id=snake", "--teleop.type=snakewalk_gait", "--teleop.id=gait"),
            *(f"--dataset.repo_id={REPO}", f"--dataset.root={root}", f"--dataset.fps={FPS}"),
            *(f"--dataset.num_episodes={episodes}", f"--dataset.episode_time_s={seconds}"),
            *("--dataset.single_task=crawl ahead", "--dataset.reset_time_s=0.2"),
            *("--dataset.push_to_hub=false", "--play_sounds=false"),
        ]
        events = {"exit_early": False, "rerecord_episode": False, "stop_recording": False}
        with (
            patch.object(lerobot_record, "init_keyboard_listener", lambda: (None, dict(events))),
            patch.object(sys, "argv", words),
        ):
            lerobot_record.main()


def with_state(batch: dict[str, Any]) -> dict[str, Any]:
    """Return a batch with the measured state as the state of the environment, which ACT needs."""
    return {**batch, OBS_ENV_STATE: batch[OBS_STATE]}


def train(root: Path, steps: int) -> tuple[ACTPolicy, Any, Any, float]:
    """Return a policy, its pre- and postprocessor, and the mean loss of its last 50 steps."""
    stats = dict(LeRobotDatasetMetadata(REPO, root=root).stats)
    stats[OBS_ENV_STATE] = stats[OBS_STATE]
    dataset = LeRobotDataset(
        REPO, root=root, delta_timestamps={ACTION: [k / FPS for k in range(CHUNK)]}
    )
    states = tuple(dataset.meta.features[OBS_STATE]["shape"])
    actions = tuple(dataset.meta.features[ACTION]["shape"])
    config = ACTConfig(
        input_features={
            OBS_STATE: PolicyFeature(FeatureType.STATE, states),
            OBS_ENV_STATE: PolicyFeature(FeatureType.ENV, states),
        },
        output_features={ACTION: PolicyFeature(FeatureType.ACTION, actions)},
        normalization_mapping=dict.fromkeys(("STATE", "ENV", "ACTION"), NormalizationMode.MEAN_STD),
        **{"chunk_size": CHUNK, "n_action_steps": EACH, "dim_model": 128, "n_heads": 4},
        **{"dim_feedforward": 256, "n_encoder_layers": 2, "use_vae": False, "device": "cpu"},
    )
    before, after = make_pre_post_processors(config, dataset_stats=stats)
    policy = ACTPolicy(config)
    policy.train()
    optimizer = torch.optim.AdamW(policy.parameters(), lr=3e-4, weight_decay=1e-4)
    loader = torch.utils.data.DataLoader(dataset, BATCH, shuffle=True, drop_last=True)
    losses: list[float] = []
    while len(losses) < steps:
        for batch in loader:
            loss, _ = policy.forward(before(with_state(batch)))
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            losses.append(loss.item())
            if len(losses) % 100 == 0:
                print(f"step {len(losses)}: loss {np.mean(losses[-100:]):.4f}", flush=True)
            if len(losses) == steps:
                break
    policy.eval()
    return policy, before, after, float(np.mean(losses[-50:]))


def by_policy(snake: Snakewalk, policy: ACTPolicy, before: Any, after: Any) -> Act:
    """Return a function from an observation to an action."""
    policy.reset()
    observed = [key for key, kind in snake.observation_features.items() if kind is float]
    names = list(snake.action_features)

    def act(seen: dict[str, Any]) -> dict[str, float]:
        state = torch.tensor([seen[key] for key in observed], dtype=torch.float32)
        with torch.inference_mode():
            action = after(policy.select_action(before(with_state({OBS_STATE: state}))))
        return dict(zip(names, action.squeeze(0).tolist(), strict=True))

    return act


def drive(seconds: float, make: Callable[[Snakewalk], Act]) -> tuple[float, float]:
    """Return distance, m, and median joint amplitude, rad, of the last half of a motion."""
    angles = []
    with simulated() as (body, snake):
        act, begin_m = make(snake), body.qpos()[:2]
        for _ in range(round(seconds * FPS)):
            due_s = time.monotonic() + 1.0 / FPS
            seen = snake.get_observation()
            snake.send_action(act(seen))
            angles.append([seen[key] for key in snake.action_features])
            time.sleep(max(0.0, due_s - time.monotonic()))
        moved_m = float(np.linalg.norm(body.qpos()[:2] - begin_m))
    settled = np.array(angles[len(angles) // 2 :])
    return moved_m, float(np.median(np.ptp(settled, axis=0)) / 2.0)


def teleoperated(snake: Snakewalk) -> Act:
    """Return the gait teleoperator as a function of the observation."""
    del snake
    gait = SnakewalkGait(SnakewalkGaitConfig(id="gait"))
    gait.connect()
    return lambda seen: gait.get_action()


def main() -> None:
    """Record, train and compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=6.0, help="duration of an episode")
    parser.add_argument("--steps", type=int, default=1000, help="steps of the optimizer")
    parser.add_argument("--runs", type=int, default=5, help="motions of 10 s each")
    parser.add_argument("--data", type=Path, help="keep the dataset here, or use one that exists")
    given = parser.parse_args()
    register_third_party_plugins()
    torch.manual_seed(0)
    torch.set_num_threads(1)
    with TemporaryDirectory() as folder:
        root = given.data or Path(folder) / "data"
        if not root.exists():
            record(root, given.episodes, given.seconds)
        begin_s = time.process_time()
        policy, before, after, loss = train(root, given.steps)
        cpu_s = time.process_time() - begin_s
        meta = LeRobotDatasetMetadata(REPO, root=root)
    print(
        f"lerobot {version('lerobot')}, torch {torch.__version__}; {meta.total_episodes} episodes, "
        f"{meta.total_frames} frames; {given.steps} steps in {cpu_s:.0f} CPU s, "
        f"last loss {loss:.4f}"
    )
    print("\n| controller | runs | distance in 10 s, m | joint amplitude, rad |")
    print("| --- | ---: | ---: | ---: |")
    for name, make in {
        "gait teleoperator": teleoperated,
        "ACT policy": lambda snake: by_policy(snake, policy, before, after),
    }.items():
        found = np.array([drive(10.0, make) for _ in range(given.runs)])
        low, high = found.min(axis=0), found.max(axis=0)
        spans = [f"{a:.2f} to {b:.2f}" for a, b in zip(low, high, strict=True)]
        print(f"| {name} | {given.runs} | {spans[0]} | {spans[1]} |", flush=True)


if __name__ == "__main__":
    main()
