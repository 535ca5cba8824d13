"""Film and page from the log alone, and what happens where a film cannot be drawn."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.report import artifacts
from snakewalk.controller.report.film import body_qpos, film_run, speed_up
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.topics import QposTable

Make = Callable[..., Path]


def test_the_body_lies_where_head_and_joints_say(record: RunRecord) -> None:
    mujoco = pytest.importorskip("mujoco")
    from snakewalk.sim.physics.body import build_model

    time_s, qpos = body_qpos(record)
    np.testing.assert_array_equal(time_s, record.pose.time_s)
    np.testing.assert_allclose(np.linalg.norm(qpos[:, 3:7], axis=1), 1.0)
    model = build_model(record.header.robot, record.header.world, None, 0.002)
    data = mujoco.MjData(model)
    data.qpos[:] = qpos[800]
    mujoco.mj_kinematics(model, data)
    head = record.pose.head_m[800]
    np.testing.assert_allclose(data.xipos[1], head)
    reach = np.linalg.norm(data.xipos[-1] - head)
    assert 0.3 * record.header.robot.length_m < reach < record.header.robot.length_m
    turned = np.arctan2(*(data.xmat[-1].reshape(3, 3)[1::-1, 0]))
    assert turned == pytest.approx(-record.cycle.measured_rad[800].sum(), abs=1e-6)


def test_rows_that_are_not_known_are_left_out(record: RunRecord) -> None:
    measured = record.cycle.measured_rad.copy()
    measured[10:20, 3] = np.nan
    cycle = dataclasses.replace(record.cycle, measured_rad=measured)
    time_s, qpos = body_qpos(dataclasses.replace(record, cycle=cycle))
    assert len(time_s) == len(record.cycle.time_s) - 10
    assert np.isfinite(qpos).all()


def test_coordinates_in_the_log_come_first(record: RunRecord) -> None:
    table = QposTable(np.array([0.0, 1.0]), np.zeros((2, 23)))
    time_s, qpos = body_qpos(dataclasses.replace(record, qpos=table))
    assert time_s is table.time_s
    assert qpos is table.qpos


def test_a_film_is_never_longer_than_half_a_minute() -> None:
    assert speed_up(5.0) == 1.0
    for run_s in (30.0, 46.0, 240.0, 3600.0):
        assert run_s / speed_up(run_s) < 30.0
        assert speed_up(run_s) == round(speed_up(run_s))


def test_a_waypoint_is_green_from_when_the_log_has_it_reached(
    record: RunRecord, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A body that cuts a ring's edge between two frames left it red, and all that follow."""
    pytest.importorskip("mujoco")
    pytest.importorskip("av")
    from snakewalk.sim.rendering import film

    marked: list[tuple[int, int]] = []
    frames = [0]
    monkeypatch.setattr(film, "mark_reached", lambda _, k: marked.append((k, frames[0])))
    monkeypatch.setattr(film, "Offscreen", _Blank)
    time_s, qpos = body_qpos(record)

    def on_frame(done: int, _: int) -> None:
        frames[0] = done

    film.render_film(
        film.Scene(record.header.robot, record.header.world, None),
        time_s[:100],
        qpos[:100],
        tmp_path / "film.mp4",
        style=film.Style(fps=10, size=(32, 32)),
        marks=film.Marks(waypoints_m=[(5.0, 5.0), (6.0, 6.0)], reached_s=[0.31, 0.32]),
        on_frame=on_frame,
    )
    assert marked == [(0, 4), (1, 4)]


def test_a_film_without_marks_has_no_caption_and_nothing_but_body_and_ground(
    record: RunRecord, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("av")
    from snakewalk.sim.rendering import film

    drawn: list[tuple[int, str]] = []

    class Counted(_Blank):
        def draw(self, *shown: Any) -> np.ndarray:
            drawn.append((shown[0].ngeom, shown[1]))
            return super().draw(*shown)

    monkeypatch.setattr(film, "Offscreen", Counted)
    time_s, qpos = body_qpos(record)
    scene = film.Scene(record.header.robot, record.header.world, None)
    for marks in (None, film.Marks(), film.Marks([(5.0, 5.0)])):
        film.render_film(
            scene,
            time_s[:50],
            qpos[:50],
            tmp_path / "film.mp4",
            style=film.Style(fps=5, size=(32, 32), title="walk"),
            marks=marks,
        )
    frames = len(drawn) // 3
    plain, without_waypoints, marked = drawn[:frames], drawn[frames:-frames], drawn[-frames:]
    assert {caption for _, caption in plain} == {""}
    for _, caption in (*without_waypoints, *marked):
        assert caption.startswith("walk")
        assert caption.endswith("\nhead purple, centre blue")
    assert all(a < b for (a, _), (b, _) in zip(plain, without_waypoints, strict=True))
    assert all(a < b for (a, _), (b, _) in zip(without_waypoints, marked, strict=True))


class _Blank:
    """In place of a frame buffer: what is drawn is black."""

    def __init__(self, _: object, width: int, height: int) -> None:
        self._black = np.zeros((height, width, 3), np.uint8)

    def __enter__(self) -> "_Blank":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def reload(self, *_: object) -> None:
        pass

    def draw(self, *_: object) -> np.ndarray:
        return self._black


@pytest.mark.slow
def test_film_and_page_come_from_the_log_alone(make: Make, tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    log = make(tmp_path / "run.mcap", seconds=0.7, ground="hills")
    made = artifacts.make_artifacts(read_log(log), tmp_path / "out")
    if made.film is None:
        pytest.skip(made.notes[0])
    assert made.notes == ()
    with av.open(str(made.film)) as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert len(frames) in (10, 11)
    assert frames[0].shape == (450, 800, 3)
    assert frames[0].std() > 10.0, "not a black picture"
    assert made.report is not None
    assert "data:video/mp4;base64," in made.report.read_text(encoding="utf-8")


@pytest.fixture
def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the pictures of a page, which other tests draw."""
    monkeypatch.setattr(artifacts, "_draw", lambda record, made: artifacts.Drawings([], "", made))


@pytest.mark.usefixtures("without_pictures")
def test_what_cannot_be_drawn_is_said_in_a_line(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing_draws(*_: object, **__: object) -> int:
        raise InputError("films need an OpenGL that draws without a screen")

    monkeypatch.setattr(artifacts, "film_run", nothing_draws)
    made = artifacts.make_artifacts(read_log(make(tmp_path / "run.mcap", seconds=1.0)), tmp_path)
    assert made.notes == ("no film: films need an OpenGL that draws without a screen",)
    assert made.film is None
    assert made.report is not None
    assert "<video" not in made.report.read_text(encoding="utf-8")


@pytest.mark.usefixtures("without_pictures")
def test_an_interrupted_film_costs_neither_the_page_nor_an_older_film(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(_: object, path: Path, **__: object) -> int:
        path.write_bytes(b"half a film")
        raise KeyboardInterrupt

    monkeypatch.setattr(artifacts, "film_run", interrupted)
    log = make(tmp_path / "log.mcap", seconds=1.0)
    with pytest.raises(KeyboardInterrupt):
        artifacts.make_artifacts(read_log(log), tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "log.mcap",
        "report.html",
        "summary.json",
    ]
    film = tmp_path / "film.mp4"
    film.write_bytes(b"whole, of this run")
    with pytest.raises(KeyboardInterrupt):
        artifacts.make_artifacts(read_log(log), tmp_path)
    assert film.read_bytes() == b"whole, of this run"
    assert "<video" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_log_without_poses_has_no_film(make: Make, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    record = read_log(make(tmp_path / "run.mcap", seconds=0.02))
    with pytest.raises(InputError, match="nothing to film"):
        film_run(record, tmp_path / "film.mp4")
