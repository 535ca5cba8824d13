"""The bench of films of real animals: descriptions, and the comparison with marks and midlines."""

import numpy as np
import pytest

from benchmarks.films.__main__ import summary
from benchmarks.films.described_film import SHIPPED, DescribedFilm, Marks, films_of
from benchmarks.films.judged_film import JudgedFilm, compare_lines, compare_marks
from benchmarks.films.rendered import SCENES, scenes
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import Capture
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.resample import equal_arc_length
from tests.oracles.skeleton_accuracy import covered_error, point_error

LINE = np.column_stack([np.linspace(0.0, 100.0, 101), np.zeros(101)])


def _captured(*lines: np.ndarray, expected_px: float = 1.0) -> Capture:
    count = len(lines)
    return Capture(
        points_px=np.stack(lines),
        radius_px=np.full((count, 101), 3.0),
        length_px=np.full(count, 100.0),
        status=(FrameStatus.GOOD,) * count,
        expected_px=np.full(count, expected_px),
        distractors=np.zeros(count),
        margin=np.ones(count),
        rate_hz=30.0,
        time_s=np.arange(count) / 30.0,
        head_by="given",
        head_sure=1.0,
    )


def test_a_description_is_found_beside_its_film_and_in_the_package(tmp_path):
    (tmp_path / "larva").mkdir()
    (tmp_path / "larva" / "one.mp4").touch()
    (tmp_path / "own.avi").touch()
    (tmp_path / "own.toml").write_text('film = "own.avi"\nlicence = "MIT"\nlength_px = 80.0\n')
    (tmp_path / "bare.mov").touch()
    bare, larva, own = films_of(tmp_path)
    assert (bare.path.name, bare.licence) == ("bare.mov", "not stated")
    assert larva.licence == "MIT"
    assert len(larva.animals[0].ends_px) == 12
    assert (own.licence, own.length_px) == ("MIT", 80.0)


def test_a_seed_draws_other_scenes_and_always_the_same():
    assert scenes(0) == SCENES
    assert scenes(7) == scenes(7)
    assert scenes(7).keys() == SCENES.keys()
    assert all(scenes(7)[name] != scenes(8)[name] != SCENES[name] for name in SCENES)


def test_the_summary_has_the_calibration_of_each_quarter():
    expected = [0.5] * 4 + [1.0] * 4 + [2.0] * 4 + [4.0] * 4
    true = [0.4] * 4 + [0.9, 0.9, 0.9, 2.1] + [1.0] * 4 + [3.0] * 4
    film = JudgedFilm("a", true_px=true, expected_px=expected, are_good=[True] * 16)
    above, first, second, *quarters = summary([film]).strip().splitlines()
    assert above.startswith("1 of 16 good frames")
    assert first.startswith("First half of each film: 1 of 8 good frames")
    assert second.endswith(
        "0 of 8 good frames with truth (0.0%) are above twice their expected "
        "error; median expected over median true error 1.50."
    )
    assert len(quarters) == 4
    assert "median true error 3.00 px, above twice 0.0%" in quarters[-1]


def test_an_unknown_key_is_a_fault(tmp_path):
    toml = tmp_path / "a.toml"
    toml.write_text('film = "a.avi"\nlength = 3\n')
    with pytest.raises(InputError, match="unknown keys length"):
        DescribedFilm.read(toml, tmp_path)


def test_each_shipped_description_states_source_and_licence(tmp_path):
    for toml in SHIPPED.glob("*.toml"):
        name = toml.read_text().split('"')[1]
        (tmp_path / name).mkdir(parents=True, exist_ok=True)
        if toml.stem == "worm-images":
            lines = tmp_path / "worm-images" / "skeletons.npz"
            np.savez(lines, skeletons=np.stack([LINE, np.full_like(LINE, np.nan)]))
        film = DescribedFilm.read(toml, tmp_path)
        assert film is not None
        assert "not stated" not in {film.source, film.licence}


def test_reversed_lines_are_counted_apart_from_their_error():
    judged = JudgedFilm("a")
    shifted = LINE + np.array([0.0, 3.0])
    compare_lines(judged, _captured(LINE, shifted[::-1], LINE), {0: LINE, 1: LINE, 2: LINE})
    assert judged.heads == [True, False, True]
    assert judged.exchanges == 2
    assert judged.true_px == pytest.approx([0.0, 3.0, 0.0])
    assert judged.above_twice == 1


def test_a_midline_that_ends_early_is_compared_where_it_goes():
    inside = equal_arc_length(LINE[4:-2], 100)
    shifted = LINE + np.array([0.0, 3.0])
    judged = JudgedFilm("a")
    short = equal_arc_length(LINE[20:], 100)
    lines = dict.fromkeys(range(3), inside)
    compare_lines(judged, _captured(LINE, shifted, short), lines, covered_error)
    assert judged.true_px[:2] == pytest.approx([0.0, 3.0], abs=0.1)
    assert judged.true_px[2] > 7.0, "a line that is too short has an error"
    assert point_error(LINE, inside) > 1.5


def test_marks_find_the_head_the_tip_and_an_exchange_of_animals():
    other = LINE + np.array([0.0, 500.0])
    one = Marks("one", {0: np.array([[5.0, 1.0], [104.0, 0.0]]), 1: LINE[[5, -1]]})
    judged = JudgedFilm("a")
    compare_marks(judged, [_captured(LINE, other), _captured(other, LINE)], (one,))
    assert judged.head_px == pytest.approx([1.0, 0.0])
    assert judged.tail_px == pytest.approx([4.0, 0.0])
    assert judged.exchanges == 1
    assert judged.heads == [True, True]


def test_a_mark_whose_animal_has_no_line_counts_as_missed():
    judged = JudgedFilm("a")
    far = Marks("far", {0: LINE[[0, -1]] + 1000.0})
    compare_marks(judged, [_captured(LINE)], (far,))
    assert np.isnan(judged.head_px).all()
    assert not judged.true_px
