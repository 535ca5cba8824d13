"""``snakewalk animal fish``: from a rendered film to a track for a run; bad input in one line."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.fish_film import swim
from snakewalk.controller.animals.fish.model import fish_model
from snakewalk.controller.animals.fish.postures import load_postures, save_postures
from snakewalk.controller.animals.fish.rendered_fish import FilmConditions, FishScene
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.track.readers.load import load_track
from tests.helpers.foreign_files import midlines

pytestmark = pytest.mark.usefixtures("legible_figures")

PNG = b"\x89PNG"


def snakewalk(*words: object) -> dict[str, object]:
    done = CliRunner().invoke(
        app, ["animal", "fish", *map(str, words), "--json"], catch_exceptions=False
    )
    assert done.exit_code == 0, done.output
    found: dict[str, object] = json.loads(done.stdout)
    return found


def refused(*words: object) -> str:
    done = CliRunner().invoke(app, ["animal", "fish", *map(str, words)])
    assert isinstance(done.exception, InputError), (words, done.output, done.exception)
    assert len(done.exception.faults) == 1
    assert "\n" not in done.exception.faults[0]
    return done.exception.faults[0]


@pytest.mark.slow
def test_film_match_and_picture(tmp_path: Path) -> None:
    tank = tmp_path / "tank"
    assert snakewalk("film", tank, "--frames", 6, "--length-px", 60)["frames"] == 6
    found = snakewalk(
        "match", tank / "top", "--background", tank / "top-background.png",
        "--truth", tank / "truth.npz", "--rate", 30, "--length", 0.3,
        "-o", tmp_path / "found.npz", "--picture", tmp_path / "match.png",
    )  # fmt: skip
    assert found["matched"] == 6
    facts = found["facts"]
    assert facts["unit"] == "m (stated by you: --length)"  # type: ignore[index]
    assert facts["time"] == "30 Hz (stated by you: --rate)"  # type: ignore[index]
    assert found["turned_round"] == 0
    assert found["head_error_deg"][0] < 2.0  # type: ignore[index]
    assert (tmp_path / "match.png").read_bytes().startswith(PNG)
    track = load_track(str(tmp_path / "found.npz"))
    assert track.length_m == pytest.approx(0.3, rel=0.01)
    assert track.frames == 6


def film_of_station(folder: Path, marks: float, frames: int = 9, length_px: float = 60.0) -> None:
    """Film a fish that beats on one spot, over a ground with a pattern of ``marks`` grey levels."""
    truth, unit, model = swim(), fish_model("carp"), fish_model("carp", length_px)
    rows, columns = round(1.8 * length_px), round(2.4 * length_px)
    scene = FishScene(rows, columns, 3, FilmConditions(marks=marks))
    folder.mkdir()
    for k in range(frames):
        base = np.array([0.3 + 0.02 * np.sin(0.4 * k), 0.02 * np.cos(0.3 * k), 0.0])
        body = unit.midline(base, 0.03 * np.sin(0.5 * k), truth.angles_rad[40 + 2 * k], 0.0)
        middle = np.array([0.5 * columns, -0.5 * rows])
        picture = scene.top(body[:, :2] * length_px + middle, model.half_width * model.length_px)
        cv2.imwrite(str(folder / f"{k:03d}.png"), picture)


@pytest.mark.nightly("a further film: 5 s of CPU")
def test_a_fish_that_holds_station_is_found_or_the_film_is_refused(tmp_path: Path) -> None:
    """The median of its frames holds the fish itself: lengths of 40 % came with exit code 0."""
    film_of_station(tmp_path / "calm", 10.0)
    out = ("--rate", 30, "-o", tmp_path / "found.npz")
    found = snakewalk("match", tmp_path / "calm", *out)
    assert "painted out" in str(found["background"])
    assert found["matched"] == 9
    assert 0.85 * 60.0 < found["length_px"] < 1.1 * 60.0  # type: ignore[operator]
    film_of_station(tmp_path / "pattern", 60.0)
    out = ("--rate", 30, "-o", tmp_path / "none.npz")
    assert "--background" in refused("match", tmp_path / "pattern", *out)
    assert not (tmp_path / "none.npz").exists()


@pytest.mark.slow
def test_synthesised_motion_is_a_recording(tmp_path: Path) -> None:
    save_postures(tmp_path / "p.npz", swim())
    made = snakewalk(
        "synthesise", tmp_path / "p.npz", "--through", "3,0", "--through", "5,2", "--mirror",
        "-o", tmp_path / "t.npz", "--picture", tmp_path / "way.png",
    )  # fmt: skip
    assert len(made["reached_s"]) == 2  # type: ignore[arg-type]
    # one frame of the motion itself turns a joint by up to 2.5 degrees
    assert made["join_step_blended_deg"] < 2.5  # type: ignore[operator]
    assert max(made["reached_within"]) <= 0.1  # type: ignore[call-overload]
    assert (tmp_path / "way.png").read_bytes().startswith(PNG)
    track = load_track(str(tmp_path / "t.npz"))
    assert track.frames > 60
    with np.load(tmp_path / "t.npz") as held:
        assert held["joints_rad"].shape == (track.frames, 16)
    again = load_postures(tmp_path / "t.npz")
    assert again.height is not None
    assert again.pitch_rad is not None
    low, high = made["height_range"]  # type: ignore[misc]
    assert (low, high) == pytest.approx((again.height.min(), again.height.max()), abs=1e-3)
    first = (tmp_path / "t.npz").read_bytes()
    assert "--force" in refused("synthesise", tmp_path / "p.npz", "-o", tmp_path / "t.npz")
    assert (tmp_path / "t.npz").read_bytes() == first


def test_bad_input_is_one_line(tmp_path: Path) -> None:
    out = ("-o", tmp_path / "o.npz")
    (tmp_path / "none").mkdir()
    (tmp_path / "cut.mp4").write_bytes(b"\x00" * 400)
    still = tmp_path / "still"
    still.mkdir()
    for k in range(3):
        cv2.imwrite(str(still / f"{k}.png"), np.full((60, 80), 128, np.uint8))
    save_postures(tmp_path / "p.npz", swim())
    assert "no such video" in refused("match", tmp_path / "gone.mp4", *out)
    assert "no images" in refused("match", tmp_path / "none", *out)
    assert "cannot read a frame" in refused("match", tmp_path / "cut.mp4", *out)
    assert "fewer than half of the frames" in refused("match", still, *out)
    assert "picture ends in" in refused("match", still, "--picture", tmp_path / "a.doc", *out)
    assert "no such file" in refused("synthesise", tmp_path / "gone.npz", *out)
    np.savez(tmp_path / "other.npz", a=1)
    assert "lacks" in refused("synthesise", tmp_path / "other.npz", *out)
    assert "X,Y" in refused("synthesise", tmp_path / "p.npz", "--through", "3", *out)
    mixed = ("--through", "3,1", "--through", "4,1,0.2")
    assert "of all control points" in refused("synthesise", tmp_path / "p.npz", *mixed, *out)
    assert "X,Y,Z" in refused("synthesise", tmp_path / "p.npz", "--through", "1,2,3,4", *out)
    assert "X,Y,Z" in refused("synthesise", tmp_path / "p.npz", "--through", "1,nan", *out)
    twice = ("--through", "1,2", "--through", "1,2")
    assert "points 1 and 2 are the same" in refused("synthesise", tmp_path / "p.npz", *twice, *out)
    small = ("--tank=-0.2,-0.2,0.3,0.3",)
    assert "as long as the fish" in refused("synthesise", tmp_path / "p.npz", *small, *out)
    assert not (tmp_path / "o.npz").exists()


@pytest.mark.parametrize("name", ["match", "synthesise", "film"])
def test_help_shows_an_example(name: str) -> None:
    done = CliRunner().invoke(app, ["animal", "fish", name, "--help"])
    assert done.exit_code == 0
    assert f"snakewalk animal fish {name}" in done.stdout


def test_a_fish_that_cannot_keep_its_distance_is_reported(tmp_path: Path) -> None:
    """A fish of nearly straight segments left its tank by 15 lengths without a word."""
    save_postures(tmp_path / "postures.npz", swim())
    first = tmp_path / "first.npz"
    words = [
        "animal",
        "fish",
        "synthesise",
        str(tmp_path / "postures.npz"),
        "--seconds",
        "6",
        "--json",
    ]
    for options, warning in (
        (["--tank=-20,-20,20,20", "-o", str(first)], ""),
        (["--tank=-1.2,-0.3,0.4,0.3", "--apart", "0.1"], "the fish leaves the tank by"),
        (["--avoid", str(first)], "come nearer than --apart to walls or fish"),
    ):
        out = [] if "-o" in options else ["-o", str(tmp_path / "track.npz"), "--force"]
        done = CliRunner().invoke(app, words + options + out, catch_exceptions=False)
        assert done.exit_code == 0
        assert warning in done.stderr
        assert bool(warning) == bool(done.stderr.strip())


def test_midlines_keep_the_facts_of_their_file(tmp_path: Path) -> None:
    file, out = midlines(tmp_path / "m.csv"), ("-o", tmp_path / "o.npz")
    found = snakewalk("match", file, *out)
    assert found["facts"]["unit"] == "m (stated by the names of its columns)"  # type: ignore[index]
    assert set(found["facts"]) == {"quantity", "unit", "order", "time"}  # type: ignore[call-overload]
    words = ("match", file, "--length", 1, "--force", *out)
    assert "--length and --background need images" in refused(*words)
