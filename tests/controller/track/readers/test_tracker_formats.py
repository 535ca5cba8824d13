"""Small files of each tracker, written to their documented layout, give back the same body."""

import json
import pickle
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pytest
from pydantic import ValidationError
from scipy.io import savemat

from snakewalk.config.errors import InputError
from snakewalk.config.file_units import si_value
from snakewalk.controller.track.choice import ALL, Choice
from snakewalk.controller.track.readers.keypoints import Keypoints
from snakewalk.controller.track.readers.load import load_file
from tests.helpers import tracker_files
from tests.helpers.travelling import FRAMES, RATE_HZ, ends, wave_angles

BODY = ends(wave_angles(), 80.0)[:, ::10] + 200.0  # (60, 11, 2), y upwards
PIXELS = BODY * [1.0, -1.0] + [0.0, 480.0]  # rows downwards
NODES = [f"p{k}" for k in range(11)]


def same(track, length_m=None, rate_hz=RATE_HZ, frames=FRAMES):
    assert track.frames == frames
    assert track.rate_hz == pytest.approx(rate_hz)
    if length_m is None:
        assert track.length_m is None
    else:
        assert track.length_m == pytest.approx(length_m, rel=2e-3)
    heading = wave_angles()[: len(track.angles_rad)]
    assert np.abs(track.angles_rad - heading)[:, 5:-5].max() < 0.06  # eleven points of a wave
    return track


def dlc_csv(path, likelihood=None, **options):
    tracker_files.dlc_csv(
        path, PIXELS, np.full(BODY.shape[:2], 0.99) if likelihood is None else likelihood, **options
    )


def dlc_h5(path, likelihood=None, **options):
    tracker_files.dlc_h5(
        path, PIXELS, np.full(BODY.shape[:2], 0.99) if likelihood is None else likelihood, **options
    )


def sleap_h5(path, scores=None, **options):
    tracker_files.sleap_h5(
        path, PIXELS, np.full(BODY.shape[:2], 0.9) if scores is None else scores, **options
    )


def wcon(**more):
    records = [
        {"id": "1", "t": k / RATE_HZ, "x": BODY[k, :, 0].tolist(), "y": BODY[k, :, 1].tolist()}
        for k in range(FRAMES)
    ]
    return {"units": {"t": "s", "x": "mm", "y": "mm"}, "data": records} | more


def test_deeplabcut_as_csv_and_hdf5_with_three_and_four_header_rows(tmp_path: Path) -> None:
    for individuals in (None, "eel"):
        dlc_csv(tmp_path / "eelDLC.csv", individuals=individuals)
        dlc_h5(tmp_path / "eelDLC.h5", individuals=individuals)
        dlc_h5(tmp_path / "newDLC.h5", individuals=individuals, protocol=4)
        for name in ("eelDLC.csv", "eelDLC.h5", "newDLC.h5"):
            track = same(load_file(tmp_path / name, Choice(rate=RATE_HZ)))
            assert not track.rate_assumed
    assert load_file(tmp_path / "eelDLC.csv").rate_assumed


def test_what_a_tracker_was_not_sure_of_is_missing(tmp_path: Path) -> None:
    sure = np.full(BODY.shape[:2], 0.9)
    sure[10, 4], sure[20:22, 0] = 0.3, 0.7
    dlc_csv(tmp_path / "a.csv", likelihood=sure)
    dlc_h5(tmp_path / "a.h5", likelihood=sure)
    sleap_h5(tmp_path / "s.h5", scores=sure)
    for name, usual in (("a.csv", 1), ("a.h5", 1), ("s.h5", 0)):
        for least, bridged in ((None, usual), (0.0, 0), (0.8, 3)):
            track = load_file(tmp_path / name, Choice(rate=RATE_HZ, min_score=least))
            assert (track.dropped, track.bridged) == (0, bridged)
        with pytest.raises(InputError, match=r"scores less than 0.95.*lower the least score"):
            load_file(tmp_path / name, Choice(rate=RATE_HZ, min_score=0.95))


def test_one_frame_is_told_as_such_and_not_as_a_low_score(tmp_path: Path) -> None:
    dlc_csv(tmp_path / "a.csv")
    rows = (tmp_path / "a.csv").read_text().splitlines()
    (tmp_path / "one.csv").write_text("\n".join(rows[:4]) + "\n")
    with pytest.raises(InputError, match="holds 1 frame; two or more are needed"):
        load_file(tmp_path / "one.csv", Choice(rate=RATE_HZ))


def test_sleap_analysis(tmp_path: Path) -> None:
    sleap_h5(tmp_path / "one.h5")
    assert same(load_file(tmp_path / "one.h5", Choice(rate=20.0))).dropped == 0
    sleap_h5(tmp_path / "two.h5", animals=2)
    with pytest.raises(InputError, match=r"2 animals in it \(eel, other\): give --individual"):
        load_file(tmp_path / "two.h5")
    with h5py.File(tmp_path / "one.h5", "a") as file:
        del file["tracks"]
        file["tracks"] = np.zeros((60, 11, 2, 1))
    with pytest.raises(InputError, match=r"expected \(tracks, 2, nodes, frames\)"):
        load_file(tmp_path / "one.h5")


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 0, 2, 1)])
def test_axes_and_rate_that_sleap_io_names(order: tuple[int, ...], tmp_path: Path) -> None:
    names, tracks = ("track", "xy", "node", "frame"), PIXELS.T[None]
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["tracks"], file["track_occupancy"] = tracks.transpose(order), np.ones((FRAMES, 1))
        file["tracks"].attrs["dims"] = json.dumps([names[k] for k in order])
        file["node_names"], file["track_names"] = [n.encode() for n in NODES], [b"eel"]
        file.attrs["video_backend_metadata"] = json.dumps({"fps": RATE_HZ})
    assert not same(load_file(tmp_path / "a.h5")).rate_assumed
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["tracks"].attrs["dims"] = file.attrs["video_backend_metadata"] = "{"
    if order == (0, 1, 2, 3):
        assert load_file(tmp_path / "a.h5").rate_assumed
    else:
        with pytest.raises(InputError, match=r"expected \(tracks, 2, nodes, frames\)"):
            load_file(tmp_path / "a.h5")


def test_images_of_hand_labels_say_which_frames_they_are(tmp_path: Path) -> None:
    dlc_csv(tmp_path / "a.csv")
    head, rows = (lines := (tmp_path / "a.csv").read_text().splitlines())[:3], lines[3:]
    label = "labeled-data/eel/img{:03}.png"

    def write(numbers) -> Path:
        cells = [row.partition(",")[2] for row in rows]
        labels = [label.format(n) + "," + c for n, c in zip(numbers, cells, strict=True)]
        (tmp_path / "b.csv").write_text("\n".join([*head, *labels]) + "\n")
        return tmp_path / "b.csv"

    track = load_file(write(range(5, 5 + 2 * FRAMES, 2)), Choice(rate=RATE_HZ))
    np.testing.assert_allclose(np.diff(track.time_s), 2.0 / RATE_HZ)
    with pytest.raises(InputError, match="do not rise; expected the labels of one film"):
        load_file(write([*range(30), *range(30)]), Choice(rate=RATE_HZ))


def test_keypoints_in_another_order_than_along_the_body_are_told() -> None:
    mixed = sorted(NODES)  # p0, p1, p10, p2: as sleap-io orders the columns of its tables
    places = BODY[:, [NODES.index(name) for name in mixed]]
    found = Keypoints(Path("eel.csv"), mixed, places, None, RATE_HZ)
    with pytest.raises(InputError, match=r"eel.csv: its keypoints do not lie.*give --keypoints"):
        found.track(ALL)
    same(found.track(Choice(keypoints=tuple(NODES))))


@pytest.mark.parametrize("old", [True, False])
def test_matlab_before_and_since_version_7_3(old: bool, tmp_path: Path) -> None:
    def write(path, held):
        if old:
            savemat(path, held)
            return
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, value in held.items():
                text = isinstance(value, str)
                data = np.array([list(map(ord, value))], np.uint16) if text else np.asarray(value)
                file.create_dataset(name, data=np.atleast_2d(data).T)
                file[name].attrs["MATLAB_class"] = np.bytes_("char" if text else "double")
        with path.open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")

    write(
        tmp_path / "a.mat",
        {"points": BODY / 1e3, "rate_hz": RATE_HZ, "length_m": 0.08, "name": "eel"},
    )
    assert same(load_file(tmp_path / "a.mat"), 0.08).name == "eel"
    time = np.arange(FRAMES) / RATE_HZ
    write(tmp_path / "b.mat", {"x": BODY[..., 0], "y": BODY[..., 1], "t": time[:, None]})
    same(load_file(tmp_path / "b.mat"))
    same(load_file(tmp_path / "b.mat", Choice(rate=5.0)), rate_hz=5.0)
    write(tmp_path / "c.mat", {"other": BODY})
    with pytest.raises(InputError, match="found other"):
        load_file(tmp_path / "c.mat")
    write(tmp_path / "d.mat", {"x": BODY[..., 0], "y": BODY[:, 1:, 1], "t": time[:, None]})
    with pytest.raises(InputError, match="x and y must both be"):
        load_file(tmp_path / "d.mat")
    data = (tmp_path / "a.mat").read_bytes()
    (tmp_path / "cut.mat").write_bytes(data[: len(data) // 3])
    with pytest.raises(InputError, match=r"cut\.mat: (cannot be read|is no HDF5)") as caught:
        load_file(tmp_path / "cut.mat")
    assert len(caught.value.faults) == 1


def test_wcon_one_record_a_time_or_many_units_head_and_origin(tmp_path: Path) -> None:
    path = tmp_path / "worm.wcon"
    path.write_text(json.dumps(wcon()))
    same(load_file(path), 0.08)
    tail_first = {
        "id": 1,
        "t": list(range(FRAMES)),
        "x": (BODY[:, ::-1, 0] - 5.0).tolist(),
        "y": (BODY[:, ::-1, 1] + 7.0).tolist(),
        "head": "R",
        "ox": 5.0,
        "oy": [-7.0] * FRAMES,
        "@lab": {"unknown": True},
    }
    units = {"t": "0.05*s", "x": "micrometres", "y": "um"}
    path.write_text("\ufeff" + json.dumps({"units": units, "data": tail_first}), encoding="utf-8")
    track = same(load_file(path), 80e-6)
    np.testing.assert_allclose(track.points, BODY * 1e-6, rtol=1e-9)
    with zipfile.ZipFile(tmp_path / "worm.wcon.zip", "w") as archive:
        archive.write(path, "worm.wcon")
    same(load_file(tmp_path / "worm.wcon.zip"), 80e-6)


def test_wcon_gaps_missing_points_and_other_counts(tmp_path: Path) -> None:
    path = tmp_path / "worm.json"
    held = wcon(units={"t": "s", "x": "px", "y": "px"})
    held["data"][7]["x"][3] = None
    held["data"][9]["x"] = held["data"][9]["x"][::2]  # six points where others have eleven
    held["data"][9]["y"] = held["data"][9]["y"][::2]
    del held["data"][30:33]
    path.write_text(json.dumps(held))
    track = load_file(path)
    assert track.dropped == 1
    assert track.length_m is None  # a pixel is no length
    assert track.frames == 56
    assert track.points.shape[1] == 11
    assert np.diff(track.time_s).max() == pytest.approx(4 / RATE_HZ)


def test_faults_of_wcon_are_one_line(tmp_path: Path) -> None:
    path = tmp_path / "bad.wcon"
    good = wcon()
    two = wcon()
    two["data"][3]["id"] = "2"
    uneven = wcon()
    uneven["data"][3]["y"] = [1.0]
    for held, said in (
        ("{", "is no JSON"),
        ('{"units": 1}', "expected a WCON object"),
        (json.dumps(good | {"units": {"t": "s", "x": "mm"}}), "units: y must be given"),
        (json.dumps(good | {"units": {"t": "mm", "x": "mm", "y": "mm"}}), "t: expected a time"),
        (json.dumps(good | {"units": {"t": "s", "x": "mm", "y": "px"}}), "some are lengths"),
        (json.dumps(two), r"2 animals in it \(1, 2\): give --individual"),
        (json.dumps(uneven), r"data\[3\]: expected id"),
        (json.dumps(good | {"data": []}), "2 or more times, found 0"),
        (json.dumps(good | {"data": [good["data"][0]] * 3}), "a time twice"),
    ):
        path.write_text(held)
        with pytest.raises(InputError, match=said) as caught:
            load_file(path)
        assert len(caught.value.faults) == 1


def test_faults_of_deeplabcut_and_scores_are_one_line(tmp_path: Path) -> None:
    head, _ = tracker_files.dlc_rows(PIXELS, PIXELS[..., 0], "eel")
    columns = list(zip(*(row[1:] for row in head), strict=True))
    path = tmp_path / "bad.h5"
    both = [("s", "a" if k < 15 else "b", *name[2:]) for k, name in enumerate(columns)]
    evil = pickle.dumps([(1, [Path])])  # names a class: never called
    for names, said in (
        (both, "2 animals"),
        (columns[:5], "5 column names for 33 columns"),
        (evil, "cannot be read; use DeepLabCut's CSV"),
        (b"no pickle", "cannot be read"),
        ([("s", "eel", p, "z" if c == "y" else c) for _, _, p, c in columns], "expected x and y"),
    ):
        dlc_h5(path, columns=names)
        with pytest.raises(InputError, match=said):
            load_file(path)
    text = "scorer,s,s\nbodyparts,a,a\ncoords,x,y\n0,1,left\n"
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(InputError, match="line 4: a y: expected a number or nothing, found 'left'"):
        load_file(tmp_path / "bad.csv")
    (tmp_path / "pair.csv").write_text("frame_idx,a.x,a.y\n0,1,1\n1,2,2\n")
    with pytest.raises(InputError, match="holds no scores"):
        load_file(tmp_path / "pair.csv", choice=Choice(min_score=0.5))
    with pytest.raises(ValidationError, match="less than or equal to 1"):
        Choice(min_score=7.0)


@pytest.mark.parametrize(
    ("unit", "dimension", "value"),
    [
        ("mm", "m", 1e-3),
        ("millimeters", "m", 1e-3),
        ("in/72", "m", 0.0254 / 72),
        ("microns", "m", 1e-6),
        ("µm", "m", 1e-6),
        ("Mm", "m", 1e6),
        ("inches", "m", 0.0254),
        ("ms", "s", 1e-3),
        ("min", "s", 60.0),
        ("0.04*s", "s", 0.04),
        ("1/s", "s", None),
        ("", "m", None),
        ("px", "m", None),
        ("mm*mm", "m", None),
    ],
)
def test_units_of_the_wcon_format(unit: str, dimension: str, value: float | None) -> None:
    assert si_value(unit, dimension) == (value if value is None else pytest.approx(value))
