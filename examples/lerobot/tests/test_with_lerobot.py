"""Teleoperate, record and replay with LeRobot's own loops; ``make lerobot`` runs these tests.

The servos are simulated in another process, which ``snakewalk bus serve`` runs in real time.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from lerobot.robots import RobotConfig
from lerobot.scripts import lerobot_record, lerobot_replay, lerobot_teleoperate
from lerobot.teleoperators import TeleoperatorConfig
from lerobot.utils.import_utils import register_third_party_plugins

import snakewalk as sw
from lerobot_robot_snakewalk import Snakewalk, SnakewalkConfig

ROBOT = "yaw16"
FPS = 20


@pytest.fixture(scope="module", autouse=True)
def registered() -> None:
    register_third_party_plugins()


@pytest.fixture
def served() -> Iterator[str]:
    """Return the device of a served bus."""
    words = [
        Path(sys.executable).parent / "snakewalk",
        "bus",
        "serve",
        "--servos",
        "1-16",
        "--json",
    ]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as server:
        yield json.loads(server.stdout.readline())["port"]
        server.terminate()


def run(command: object, name: str, *options: str) -> None:
    """Call a program of LeRobot with a command line."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [name, *options])
        command()


def robot(port: str) -> list[str]:
    return ["--robot.type=snakewalk", f"--robot.port={port}", "--robot.id=snake"]


TELEOP = ["--teleop.type=snakewalk_gait", "--teleop.id=gait"]


def test_both_types_are_found() -> None:
    assert "snakewalk" in RobotConfig.get_known_choices()
    assert "snakewalk_gait" in TeleoperatorConfig.get_known_choices()


def test_teleoperate(served: str, monkeypatch: pytest.MonkeyPatch) -> None:
    lag_rad = []
    send = Snakewalk.send_action

    def measured(self: Snakewalk, action: dict) -> dict:
        sent = send(self, action)
        seen = self.get_observation()
        lag_rad.append(max(abs(seen[key] - sent[key]) for key in sent))
        return sent

    monkeypatch.setattr(Snakewalk, "send_action", measured)
    run(
        lerobot_teleoperate.main, "lerobot-teleoperate", *robot(served), *TELEOP,
        f"--fps={FPS}", "--teleop_time_s=4",
    )  # fmt: skip
    print(f"largest lag {max(lag_rad):.3f} rad in {len(lag_rad)} frames")
    assert len(lag_rad) > FPS
    assert max(lag_rad) < 0.3


def test_record_and_replay(served: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lerobot_record, "init_keyboard_listener", lambda: (None, {
        "exit_early": False, "rerecord_episode": False, "stop_recording": False,
    }))  # fmt: skip
    folder = tmp_path / "dataset"
    dataset = ["--dataset.repo_id=snakewalk/test", f"--dataset.root={folder}"]
    run(
        lerobot_record.main, "lerobot-record", *robot(served), *TELEOP, *dataset,
        "--dataset.single_task=undulate", f"--dataset.fps={FPS}", "--dataset.num_episodes=2",
        "--dataset.episode_time_s=2", "--dataset.reset_time_s=0.5",
        "--dataset.push_to_hub=false", "--play_sounds=false",
    )  # fmt: skip
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert info["total_episodes"] == 2
    names = info["features"]["action"]["names"]
    assert names == [f"{each}.pos" for each in sw.load_robot(ROBOT).joint_names]
    sent = []
    send = Snakewalk.send_action
    monkeypatch.setattr(
        Snakewalk, "send_action", lambda self, action: sent.append(send(self, action)) or sent[-1]
    )
    run(
        lerobot_replay.main, "lerobot-replay", *robot(served), *dataset,
        "--dataset.episode=1", "--play_sounds=false",
    )  # fmt: skip
    assert len(sent) > FPS
    assert np.ptp([each[names[8]] for each in sent]) > 0.2


def test_simulated_in_this_process() -> None:
    with Snakewalk(SnakewalkConfig(port="sim", id="snake")) as snake:
        start = snake.get_observation()
        goal = {key: start[key] + 0.05 for key in snake.action_features}
        for _ in range(20):
            sent = snake.send_action(goal)
        assert sent == pytest.approx(goal, abs=1e-3)
    assert not snake.is_connected


def test_the_simulator_camera_is_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lerobot_record, "init_keyboard_listener", lambda: (None, {
        "exit_early": False, "rerecord_episode": False, "stop_recording": False,
    }))  # fmt: skip
    folder = tmp_path / "dataset"
    run(
        lerobot_record.main, "lerobot-record", *robot("sim"), *TELEOP,
        "--robot.simulator_camera=true", "--dataset.repo_id=snakewalk/seen",
        f"--dataset.root={folder}", "--dataset.single_task=undulate", "--dataset.fps=10",
        "--dataset.num_episodes=1", "--dataset.episode_time_s=3", "--dataset.reset_time_s=0.5",
        "--dataset.push_to_hub=false", "--dataset.vcodec=h264", "--play_sounds=false",
    )  # fmt: skip
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert info["features"]["observation.images.simulator"]["shape"] == [480, 640, 3]
    assert info["total_frames"] > 5


def test_the_simulator_camera_sees_the_robot_move() -> None:
    config = SnakewalkConfig(port="sim", simulator_camera=True)
    with Snakewalk(config) as snake:
        first = snake.get_observation()
        goal = {key: first[key] + 0.3 for key in snake.action_features}
        for _ in range(40):
            snake.send_action(goal)
            last = snake.get_observation()
    assert last["simulator"].shape == (480, 640, 3)
    assert last["simulator"].std() > 5.0
    changed = np.abs(last["simulator"].astype(int) - first["simulator"]).max(axis=2) > 40
    assert changed.mean() > 0.002
    assert last["yaw_01.pos"] - first["yaw_01.pos"] > 0.1


def test_the_simulator_camera_needs_simulated_servos() -> None:
    with pytest.raises(ValueError, match=r"robot\.port=sim"):
        Snakewalk(SnakewalkConfig(port="/dev/ttyUSB0", simulator_camera=True))


def test_a_trip_reaches_lerobot() -> None:
    with Snakewalk(SnakewalkConfig(port="sim")) as snake:
        goal = dict.fromkeys(snake.action_features, float("nan"))
        with pytest.raises(sw.SafetyTrippedError, match="not a number"):
            snake.send_action(goal)


def test_the_goal_is_limited() -> None:
    """A jump of 1 rad is sent in steps of the safety layer's rate."""
    with Snakewalk(SnakewalkConfig(port="sim")) as snake:
        start = snake.get_observation()
        sent = snake.send_action({key: start[key] + 1.0 for key in snake.action_features})
        assert max(sent[key] - start[key] for key in sent) < 0.8
