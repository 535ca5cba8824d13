"""What cannot be a recording is refused in one line that says what would be right."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import ConfigError, InputError
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import load_track, track_beside
from tests.helpers.travelling import RATE_HZ, ends, wave_angles


def text(words: str) -> Callable[[Path], None]:
    return lambda path: path.write_text(words) and None


def arrays(**held: object) -> Callable[[Path], None]:
    return lambda path: np.savez(path, **held)


def joints(values: object) -> Callable[[Path], None]:
    return lambda path: np.save(path, values)


HEAD = "t,frame,point,x_m,y_m\n"
FOUR = "".join(f"0,1,{p},{p},0\n" for p in range(1, 5))
POINTS = ends(wave_angles())


@pytest.mark.parametrize(
    ("name", "make", "said"),
    [
        ("empty.csv", text(""), "is empty"),
        ("film.avi", lambda path: path.write_bytes(b"RIFF\x00\x00\x00\x00AVI "), "known: a CSV"),
        ("old.mat", lambda path: path.write_bytes(b"MATLAB 5.0\xff\x00"), "known: a CSV"),
        ("one.csv", text("t,frame,point,x_m,y_m"), "then rows of numbers"),
        ("other.csv", text("a,b\n1,2\n"), "found a, b"),
        ("word.csv", text(HEAD + "0,1,1,left,0\n"), "line 2: x_m: expected a number.*'left'"),
        ("twice.csv", text(HEAD + FOUR + FOUR), "more than one animal"),
        ("uneven.csv", text(HEAD + FOUR + "1,2,1,0,0\n"), "frame 2 differs"),
        ("still.csv", text(HEAD + FOUR + FOUR.replace("0,1,", "0,2,")), "t must increase"),
        ("few.csv", text(HEAD + "0,1,1,0,0\n1,2,1,0,0\n"), "4 or more"),
        (
            "nan.csv",
            text(HEAD + FOUR + FOUR.replace("0,1,", "1,2,").replace(",0\n", ",\n")),
            "only 1 of 2 frames hold a midline",
        ),
        ("pair.csv", text("frame_idx,a.x,a.y\n0,1,1\n0,2,2\n"), "more than one animal"),
        ("three.csv", text("frame_idx,a.x,a.y\n0,1,1\n1,2,2\n"), "4 or more"),
        ("lost.csv", text("frame_idx,a.x,a.y\n,1,1\n1,2,2\n"), "frame_idx must be given"),
        ("empty.npz", arrays(other=np.zeros(3)), "found other"),
        ("rate.npz", arrays(points=POINTS), "and rate_hz"),
        ("rate0.npz", arrays(points=POINTS, rate_hz=0.0), "above 0 Hz"),
        ("rates.npz", arrays(points=POINTS, rate_hz=[1.0, 2.0]), "rate_hz: expected one number"),
        ("words.npz", arrays(points=np.array(["a"]), rate_hz=RATE_HZ), "expected numbers"),
        ("flat.npz", arrays(angles_rad=np.zeros(9), rate_hz=RATE_HZ), r"not an array of .*\(9,\)"),
        ("pair.npz", arrays(skeletons=np.stack([POINTS, POINTS])), "points must be"),
        ("nan.npz", arrays(points=POINTS * np.nan, rate_hz=RATE_HZ), "only 0 of 60 frames"),
        ("cut.npz", lambda path: path.write_bytes(b"PK\x03\x04 and no more"), "no .*npz|is not an"),
        ("flat.npy", joints(np.zeros(9)), r"\(9,\)"),
        ("pickle.npy", joints(np.array([{}], dtype=object)), "plain numbers"),
    ],
)
def test_faults_are_one_line_with_the_file_s_name(
    name: str, make: Callable[[Path], None], said: str, tmp_path: Path
) -> None:
    make(tmp_path / name)
    with pytest.raises(InputError, match=said) as caught:
        load_track(str(tmp_path / name))
    lines = [line for line in caught.value.faults if not line.startswith("column ")]
    assert len(lines) == 1
    assert Path(name).stem in lines[0]


def test_what_does_not_exist_is_told_names_and_formats(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nosuch.*shipped are lamprey-like, worm-like.*\.npz"):
        load_track("nosuch")
    with pytest.raises(InputError, match=r"gone\.csv: no such recording or file"):
        load_track(str(tmp_path / "gone.csv"))
    with pytest.raises(InputError, match=str(tmp_path)):
        load_track(str(tmp_path))


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_a_frame_rate_is_above_zero(rate: float, tmp_path: Path) -> None:
    np.savez(tmp_path / "good.npz", points=POINTS, rate_hz=RATE_HZ)
    (tmp_path / "good.npz.reading.toml").write_text(f"rate = {rate}\n")
    with pytest.raises(ConfigError, match="rate: must be "):
        load_track(str(tmp_path / "good.npz"))


def test_figures_of_your_own_are_checked_like_every_configuration(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('name = "mine"\nwaves = -1\n')
    with pytest.raises(InputError, match=r"mine\.toml:2: waves"):
        load_track(str(tmp_path / "mine.toml"))
    with pytest.raises(InputError, match="hold the frame rate"):
        load_track("worm-like", Choice(rate=60.0))


def test_a_run_names_its_recording_relative_to_itself(tmp_path: Path) -> None:
    (tmp_path / "eel.csv").write_text("")
    assert track_beside("eel.csv", tmp_path) == str(tmp_path / "eel.csv")
    assert track_beside("other.csv", tmp_path) == "other.csv"
    assert track_beside("worm-like", tmp_path) == "worm-like"
    assert track_beside("eel.csv", None) == "eel.csv"
