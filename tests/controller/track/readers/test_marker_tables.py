"""Markers of motion capture: tables with NA, unlabelled and stationary markers, Vicon and TRC."""

import re
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


def motive(path: Path, names: list[str], places: np.ndarray, missing: str = "") -> None:
    """Write a take as Motive 3 does: a rigid body before the markers, and its expected markers."""
    about = {
        "Format Version": "1.24",
        "Take Name": "eel",
        "Capture Frame Rate": f"{4 * RATE_HZ:.6f}",
        "Export Frame Rate": f"{RATE_HZ:.6f}",
        "Rotation Type": "Quaternion",
        "Length Units": "Millimeters",
        "Coordinate Space": "Global",
    }
    body, expected, markers = 7, 3, 3 * len(names)
    kinds = ["Rigid Body"] * body + ["Rigid Body Marker"] * expected + ["Marker"] * markers
    titles = ["box"] * body + ["box:1"] * expected + [f"Eel:{n}" for n in names for _ in "xyz"]
    parts = ["Rotation"] * 4 + ["Position"] * (body - 4 + expected + markers)
    axes = [*"XYZW", *("XYZ" * (2 + len(names)))]
    rows = [",".join(word for pair in about.items() for word in pair), ""]
    heads = (("Type", kinds), ("Name", titles), ("ID", kinds), ("", parts))
    rows += [",".join(["", label, *cells]) for label, cells in heads]
    rows.append(",".join(["Frame", "Time (Seconds)", *axes]))
    fixed = ["0", "0", "0", "1", "1", "2", "3", "4", "5", "6"]
    rows += [
        ",".join([str(k), f"{k / RATE_HZ:.6f}", *fixed, *row])
        for k, row in enumerate(cells(places, missing))
    ]
    path.write_text("\n".join(rows) + "\n")


WRITERS = {"m.tsv": qtm, "v.csv": vicon, "t.trc": trc, "o.csv": motive}


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
    assert notes[-2:] == (
        "2 markers without a label are left out: *17, Unlabeled 4; --keypoints uses them",
        "1 markers that do not move are left out: floor; --keypoints uses them",
    )
    chosen = load_file(tmp_path / name, choice=Choice(keypoints=tuple(NODES)))
    assert same(chosen).notes == notes[:-2]


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
    for name in ("v.csv", "t.trc", "o.csv"):
        WRITERS[name](tmp_path / name, NODES, BODY)
        lines = (tmp_path / name).read_text().splitlines()
        begin = next(k for k, line in enumerate(lines) if line.startswith(("21,", "21\t")))
        text = "\n".join(lines[:begin] + lines[begin + 9 :]).replace("\t60\t11", "\t51\t11")
        (tmp_path / name).write_text(text)
        assert same(load_file(tmp_path / name)).absent == 9


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("v.csv", lambda text: text.replace("mm", "px"), "its unit is 'px'"),
        ("v.csv", lambda text: text[: text.index("Frame,")], "ends before its rows"),
        ("v.csv", lambda text: text.replace("\n5,0,", "\nx,0,"), "expected a frame number"),
        ("t.trc", lambda text: text.replace("\tmm\t", "\tcubits\t"), "its unit is 'cubits'"),
        ("t.trc", lambda text: text.replace("\n20\t20", "\n0\t20"), "states no DataRate"),
        ("t.trc", lambda text: text[: len(text) // 2], "states NumFrames 60"),
        ("t.trc", lambda text: "\n".join(text.splitlines()[:5]), "five head lines"),
        ("o.csv", lambda text: text.replace("Millimeters", "Cubits"), "its unit is 'Cubits'"),
        ("o.csv", lambda text: text.replace("Global", "Local"), "export it in Global"),
        ("o.csv", lambda text: text.replace("Position", "Velocity"), "has no positions of markers"),
        (
            "o.csv",
            lambda text: text.replace("Frame Rate,", "Frame Rate,7"),
            "frames a second, and its times .*; give --rate",
        ),
        ("o.csv", lambda text: text[: text.index(",ID")], "expected rows of types, names"),
        ("o.csv", lambda text: text.replace("\n5,0.", "\nx,0."), "expected a frame number"),
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


def test_a_take_of_motive_names_what_it_leaves_out_and_counts_every_nth_frame(
    tmp_path: Path,
) -> None:
    motive(tmp_path / "o.csv", NODES, BODY)
    track = same(load_file(tmp_path / "o.csv"))
    left = "left out: places 1 of type Rigid Body, 1 of type Rigid Body Marker"
    assert track.notes == (left,)
    text = (tmp_path / "o.csv").read_text().replace(f"{RATE_HZ:.6f}", f"{8 * RATE_HZ:.6f}")
    text = re.sub(r"^(\d+),", lambda found: f"{4 * int(found[1])},", text, flags=re.MULTILINE)
    (tmp_path / "o.csv").write_text(text)
    assert same(load_file(tmp_path / "o.csv")).every == 4, "frames of the camera, at 120 Hz"


@pytest.mark.parametrize(("axis", "plane"), [("z", "xy"), ("y", "xz"), ("x", "yz")])
def test_the_axis_that_points_up_is_inferred_or_asked_for(
    axis: str, plane: str, tmp_path: Path
) -> None:
    turned = {"z": (0, 1, 2), "y": (0, 2, 1), "x": (2, 0, 1)}[axis]
    signs = {"z": (1, 1, 1), "y": (1, 1, -1), "x": (1, 1, 1)}[axis]
    for name, usual in (("m.tsv", "z"), ("v.csv", "z"), ("t.trc", "yz"), ("o.csv", "yz")):
        WRITERS[name](tmp_path / name, NODES, BODY)
        given = np.array([*BODY.reshape(-1, 2).T, np.full(BODY[..., 0].size, 7.0)])
        space = (given[list(turned)] * np.array(signs)[:, None]).T.reshape(FRAMES, -1, 3)
        write_in_space(tmp_path / name, space)
        if axis not in usual:
            with pytest.raises(InputError, match=r"does not state which axis points up.*--plane"):
                load_file(tmp_path / name)
        else:
            found = same(load_file(tmp_path / name)).facts["plane"]
            assert (found.value, found.source) == (plane, "inferred")
        chosen = same(load_file(tmp_path / name, choice=Choice(plane=plane)))
        assert chosen.facts["plane"].source == "user"


def write_in_space(path: Path, space: np.ndarray) -> None:
    """Replace the places of a file that one of ``WRITERS`` has written."""
    separator = "," if path.suffix == ".csv" else "\t"
    lines = path.read_text().splitlines()
    rows = [k for k, line in enumerate(lines) if line.count(".") >= 20 and "7.0000" in line]
    assert len(rows) == len(space)
    for k, places in zip(rows, space.reshape(len(space), -1), strict=True):
        cells = lines[k].split(separator)
        kept = len(cells) - places.size
        lines[k] = separator.join([*cells[:kept], *(f"{value:.4f}" for value in places)])
    path.write_text("\n".join(lines) + "\n")


def test_a_c3d_on_which_the_library_ends_its_process_is_one_line(tmp_path: Path) -> None:
    pytest.importorskip("ezc3d", reason="the extra c3d is not installed")
    from tests.foreign.tracks import c3d

    file = c3d("mm", RATE_HZ)(tmp_path)
    whole = file.read_bytes()
    for size in (600, 805, 1000, len(whole) // 2):
        file.write_bytes(whole[:size])
        with pytest.raises(InputError, match=r"m\.c3d: .*copy or export it again"):
            load_file(file)
