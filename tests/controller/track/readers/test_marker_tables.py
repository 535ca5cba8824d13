"""Markers of motion capture: tables with NA, unlabelled and stationary markers, Vicon and TRC."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import load_file
from snakewalk.controller.track.readers.markers import is_unlabelled
from snakewalk.controller.track.track import Track
from tests.helpers.travelling import FRAMES, RATE_HZ, ends, wave_angles

BODY = ends(wave_angles(), 80.0)[:, ::10] + 200.0  # (60, 11, 2) mm
BODY[..., 0] += 0.5 * np.arange(FRAMES)[:, None]
NODES = [f"p{k}" for k in range(11)]


def cells(places: np.ndarray, missing: str = "NA") -> list[list[str]]:
    """Cells x, y, z of each marker, row by row."""
    space = np.concatenate([places, np.full((*places.shape[:2], 1), 7.0)], axis=2)
    rows = space.reshape(len(places), -1)
    return [[missing if np.isnan(v) else f"{v:.4f}" for v in row] for row in rows]


def qtm(path: Path, names: list[str], places: np.ndarray, missing: str = "NA") -> None:
    head = ["NO_OF_FRAMES\t60", f"FREQUENCY\t{RATE_HZ}", "DATA_INCLUDED\t3D"]
    head.append("\t".join(["MARKER_NAMES", *names]))
    path.write_text("\n".join([*head, *("\t".join(row) for row in cells(places, missing))]))


def vicon(path: Path, names: list[str], places: np.ndarray, missing: str = "") -> None:
    rows = ["Devices", "1000", "something else", "", "Trajectories", f"{RATE_HZ:g}"]
    rows.append(",," + ",".join(f"Eel:{name},," for name in names))
    rows.append("Frame,Sub Frame," + ",".join(["X,Y,Z"] * len(names)))
    rows.append(",," + ",".join(["mm"] * 3 * len(names)))
    rows += [f"{k + 1},0," + ",".join(row) for k, row in enumerate(cells(places, missing))]
    path.write_text("\n".join([*rows, "", "Model Outputs", "100"]))


def trc(path: Path, names: list[str], places: np.ndarray, missing: str = "") -> None:
    keys = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate"
    values = f"{RATE_HZ:g}\t{RATE_HZ:g}\t{len(places)}\t{len(names)}\tmm\t{RATE_HZ:g}"
    rows = ["PathFileType\t4\t(X/Y/Z)\tmade.trc", keys, values]
    rows.append("Frame#\tTime\t" + "\t\t\t".join(names))
    axes = [f"{axis}{k + 1}" for k in range(len(names)) for axis in "XYZ"]
    rows += ["\t\t" + "\t".join(axes), ""]
    rows += ["\t".join([str(k + 1), f"{k / RATE_HZ:.5f}", *row])
             for k, row in enumerate(cells(places, missing))]  # fmt: skip
    path.write_text("\n".join(rows) + "\n")


WRITERS = {"m.tsv": qtm, "v.csv": vicon, "t.trc": trc}


def same(track: Track) -> Track:
    assert track.rate_hz == pytest.approx(RATE_HZ)
    assert track.length_m == pytest.approx(0.08, rel=2e-3)
    heading = wave_angles()[np.rint(track.time_s * RATE_HZ).astype(int)]
    assert np.abs(track.angles_rad - heading)[:, 5:-5].max() < 0.06
    return track


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("missing", ["NA", "", "NaN"])
def test_cells_that_say_that_a_marker_was_not_seen(name: str, missing: str, tmp_path: Path) -> None:
    places = BODY.copy()
    places[7] = np.nan
    places[20, 5] = np.nan
    WRITERS[name](tmp_path / name, NODES, places, missing)
    track = same(load_file(tmp_path / name))
    assert (track.frames, track.dropped, track.bridged) == (FRAMES - 1, 1, 1)


@pytest.mark.parametrize("name", WRITERS)
def test_markers_without_a_label_or_motion_are_left_out_and_named(
    name: str, tmp_path: Path
) -> None:
    floor = np.full((FRAMES, 1, 2), 300.0)
    strange = np.random.default_rng(0).normal(100.0, 50.0, (FRAMES, 2, 2))
    names = ["floor", *NODES, "*17", "Unlabeled 4"]
    WRITERS[name](tmp_path / name, names, np.concatenate([floor, BODY, strange], axis=1))
    notes = same(load_file(tmp_path / name)).notes
    assert notes == (
        "2 markers without a label are left out: *17, Unlabeled 4; --keypoints uses them",
        "1 markers that do not move are left out: floor; --keypoints uses them",
    )
    chosen = load_file(tmp_path / name, choice=Choice(keypoints=tuple(NODES)))
    assert same(chosen).notes == ()


def test_a_head_that_is_held_in_one_place_is_part_of_the_body(tmp_path: Path) -> None:
    qtm(tmp_path / "m.tsv", NODES, BODY - BODY[:, :1] + 200.0)
    assert same(load_file(tmp_path / "m.tsv")).notes == ()


def test_too_few_labelled_markers_are_a_question(tmp_path: Path) -> None:
    qtm(tmp_path / "m.tsv", [f"*{k}" for k in range(11)], BODY)
    with pytest.raises(InputError, match=r"0 markers have a label and move.*say --keypoints.*\*10"):
        load_file(tmp_path / "m.tsv")


@pytest.mark.parametrize("name", ["m1", "M12", "U3", "new", "tail", "u_7"])
def test_names_that_people_give_are_labels(name: str) -> None:
    assert not is_unlabelled(name)


def test_frame_numbers_of_vicon_and_trc_count_missing_frames(tmp_path: Path) -> None:
    for name in ("v.csv", "t.trc"):
        WRITERS[name](tmp_path / name, NODES, BODY)
        lines = (tmp_path / name).read_text().splitlines()
        begin = next(k for k, line in enumerate(lines) if line.startswith(("21,", "21\t")))
        text = "\n".join(lines[:begin] + lines[begin + 9 :]).replace("\t60\t11", "\t51\t11")
        (tmp_path / name).write_text(text)
        assert same(load_file(tmp_path / name)).absent == 9


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("v.csv", lambda text: text.replace("mm", "ft"), "one unit of mm, cm, m"),
        ("v.csv", lambda text: text[: text.index("Frame,")], "ends before its rows"),
        ("v.csv", lambda text: text.replace("\n5,0,", "\nx,0,"), "expected a frame number"),
        ("t.trc", lambda text: text.replace("\tmm\t", "\tfeet\t"), "its unit is 'feet'"),
        ("t.trc", lambda text: text.replace("\n20\t20", "\n0\t20"), "states no DataRate"),
        ("t.trc", lambda text: text[: len(text) // 2], "states NumFrames 60"),
        ("t.trc", lambda text: "\n".join(text.splitlines()[:5]), "five head lines"),
        (
            "m.tsv",
            lambda text: text.replace("207.", "left", 1),
            "expected a number or nothing, found",
        ),
    ],
)
def test_faults_say_what_is_wrong(
    name: str, change: Callable[[str], str], said: str, tmp_path: Path
) -> None:
    WRITERS[name](tmp_path / name, NODES, BODY)
    (tmp_path / name).write_text(change((tmp_path / name).read_text()))
    with pytest.raises(InputError, match=said):
        load_file(tmp_path / name)


def test_c3d_with_markers_without_a_label_and_without_motion(tmp_path: Path) -> None:
    ezc3d = pytest.importorskip("ezc3d", reason="the extra c3d is not installed")
    names = ["floor", *NODES, "*17"]
    data = np.ones((4, len(names), FRAMES))
    data[:2, 0] = 300.0
    data[:2, 1:-1] = BODY.transpose(2, 1, 0)
    data[:2, -1] = np.random.default_rng(0).normal(100.0, 50.0, (2, FRAMES))
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"], point["UNITS"]["value"] = [RATE_HZ], ["mm"]
    point["LABELS"]["value"] = names
    file["data"]["points"] = data
    file.write(str(tmp_path / "m.c3d"))
    assert len(same(load_file(tmp_path / "m.c3d")).notes) == 2
