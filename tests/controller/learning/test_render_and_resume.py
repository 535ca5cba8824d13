"""Pictures of the environment, actions of a wrong shape, and searches that are interrupted."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("cma")

import snakewalk.gym  # noqa: E402, F401
from snakewalk.config.errors import InputError  # noqa: E402
from snakewalk.controller.cli.command_line import app  # noqa: E402
from snakewalk.controller.learning import wave_search  # noqa: E402
from snakewalk.controller.learning.environment import SnakeEnvironment  # noqa: E402
from snakewalk.controller.learning.wave_search import (  # noqa: E402
    SearchProgress,
    search_progress,
    search_wave,
)
from snakewalk.drivers.clock import WallClock  # noqa: E402
from snakewalk.sim.rendering import chase_view  # noqa: E402
from snakewalk.sim.rendering.offscreen import OffscreenError  # noqa: E402

SHORT = 'name = "short"\njoint_axes = "yyy"\n'


@pytest.fixture
def robot(tmp_path: Path) -> str:
    file = tmp_path / "short.toml"
    file.write_text(SHORT)
    return str(file)


def test_rgb_array_shows_the_body_as_it_moves(robot: str) -> None:
    env = gymnasium.make("snakewalk/Snake-v0", robot=robot, render_mode="rgb_array")
    try:
        env.reset(seed=0)
        try:
            first = env.render()
        except OffscreenError as error:
            pytest.skip(str(error))
        assert first.shape == (480, 640, 3)
        assert first.dtype == np.uint8
        assert first.std() > 5.0
        for _ in range(20):
            env.step(np.ones(3, dtype=np.float32))
        assert (env.render() != first).any()
    finally:
        env.close()


class Window(SimpleNamespace):
    """MuJoCo's window, which counts what it shows."""

    def is_running(self) -> bool:
        return True

    def lock(self) -> "Window":
        return self

    def __enter__(self) -> None: ...

    def __exit__(self, *error: object) -> None: ...

    def sync(self) -> None:
        self.shown += 1

    def close(self) -> None:
        self.closed = True


def test_human_shows_each_step_in_real_time(robot: str, monkeypatch: pytest.MonkeyPatch) -> None:
    window = Window(shown=0, closed=False, cam=SimpleNamespace(lookat=np.zeros(3)))
    until_s: list[float] = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(
        chase_view.mujoco.viewer, "launch_passive", lambda model, data, **options: window
    )
    monkeypatch.setattr(WallClock, "sleep_until_s", lambda clock, time_s: until_s.append(time_s))
    env = SnakeEnvironment(robot, render_mode="human")
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros(3, dtype=np.float32))
    env.close()
    assert window.shown == len(until_s) == 4
    assert window.closed


def test_modes_that_cannot_be_are_rejected(robot: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="render_mode 'ansi': expected human, rgb_array, or None"):
        SnakeEnvironment(robot, render_mode="ansi")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(chase_view.sys, "platform", "linux")
    env = SnakeEnvironment(robot, render_mode="human")
    with pytest.raises(InputError, match="has no screen; use render_mode='rgb_array'"):
        env.reset(seed=0)
    silent = SnakeEnvironment(robot)
    silent.reset(seed=0)
    assert silent.render() is None


def test_an_action_of_a_wrong_shape_is_rejected_with_the_names_of_its_numbers(robot: str) -> None:
    env = gymnasium.make("snakewalk/Snake-v0", robot=robot, disable_env_checker=True).unwrapped
    env.reset(seed=0)
    for wrong in (np.zeros(2), np.zeros((1, 3)), np.float32(0.5)):
        with pytest.raises(
            gymnasium.error.InvalidAction, match=r"expected \(3,\).*yaw_01, yaw_02, yaw_03"
        ):
            env.step(wrong)
    wave = gymnasium.make("snakewalk/SnakeWave-v0", disable_env_checker=True).unwrapped
    wave.reset(seed=0)
    with pytest.raises(
        gymnasium.error.InvalidAction, match=r"expected \(16,\).*frequency_hz_?.*reflex_3"
    ):
        wave.step(np.zeros(3))


def quick(monkeypatch: pytest.MonkeyPatch, stop_after: int | None = None) -> list[int]:
    """Episodes that cost nothing; the search is interrupted after some."""
    episodes: list[int] = []

    def earned(policy: object, *, world: str, start: int, steps: int) -> float:
        episodes.append(start)
        if stop_after is not None and len(episodes) > stop_after:
            raise KeyboardInterrupt
        return float(-np.abs(policy.wave.vector() - 0.4).sum())  # type: ignore[attr-defined]

    monkeypatch.setattr(wave_search, "_earned_reward", earned)
    return episodes


def test_a_search_that_continues_ends_as_one_that_was_not_interrupted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    start = search_progress(robot="yaw16", world="flat", population=6, steps=50, seed=3)
    quick(monkeypatch)
    whole = search_wave("one", start, generations=5, workers=1)
    saved: list[SearchProgress] = []
    quick(monkeypatch, stop_after=15)
    with pytest.raises(KeyboardInterrupt):
        search_wave("one", start, generations=5, workers=1, on_progress=saved.append)
    assert len(saved) == 2
    again = SearchProgress.model_validate_json(saved[-1].model_dump_json())
    episodes = quick(monkeypatch)
    assert search_wave("one", again, generations=5, workers=1) == whole
    assert len(episodes) == 3 * 6


def test_the_command_continues_and_names_what_differs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = [
        "gait",
        "policy",
        "learn",
        "-o",
        "mine.toml",
        "--generations",
        "4",
        "--population",
        "6",
    ]
    words += ["--workers", "1"]

    def learn(*more: str) -> object:
        return CliRunner().invoke(app, [*words, *more])

    assert "nothing to continue" in str(learn("--resume").exception)  # type: ignore[attr-defined]
    quick(monkeypatch, stop_after=15)
    learn()
    part = Path("mine.toml.part")
    assert part.exists()
    assert not Path("mine.toml").exists()
    quick(monkeypatch)
    refused = learn()
    assert "continue it with --resume" in str(refused.exception)  # type: ignore[attr-defined]
    other = learn("--resume", "--seed", "9")
    assert "its search has seed 0, asked for 9" in str(other.exception)  # type: ignore[attr-defined]
    done = learn("--resume")
    assert done.exit_code == 0, done.output  # type: ignore[attr-defined]
    assert not part.exists()
    text = Path("mine.toml").read_text()
    learn("--force")
    assert Path("mine.toml").read_text() == text
