"""Files of several animals, keypoints out of order or missing, projects, markers in space."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.readers.arrays import save_track
from snakewalk.controller.track.readers.keypoints import bridge
from snakewalk.controller.track.readers.load import load_file, load_track
from tests.controller.track.readers.test_tracker_formats import (
    BODY,
    NODES,
    PIXELS,
    same,
    wcon,
)
from tests.helpers.tracker_files import dlc_rows
from tests.helpers.travelling import FRAMES, RATE_HZ

EEL, OTHER = Choice(individual="eel"), Choice(individual="other")


def two_dlc(path: Path) -> None:
    """Two animals and a body part of none, as DeepLabCut writes them."""
    scores = np.full(BODY.shape[:2], 0.99)
    head, values = dlc_rows(PIXELS, scores, "eel")
    _, other = dlc_rows(PIXELS, scores, "other")
    rows = [
        [head[0][0], *head[0][1:], *head[0][1:], "s", "s"],
        ["individuals", *["eel"] * 33, *["other"] * 33, "single", "single"],
        [head[2][0], *head[2][1:], *head[2][1:], "food", "food"],
        [head[3][0], *head[3][1:], *head[3][1:], "x", "y"],
    ]
    shift = np.tile([50.0, 0.0, 0.0], 11)
    both = np.hstack([values, other[::-1] + shift, np.ones((FRAMES, 2))])
    text = [",".join(row) for row in rows]
    text += [f"{k}," + ",".join(map(repr, row)) for k, row in enumerate(both.tolist())]
    path.write_text("\n".join(text) + "\n")


def project(
    path: Path, *, tracks: tuple[str, ...] = ("eel", "other"), version: float = 1.2
) -> None:
    """A SLEAP project: predictions of two animals, the first frames of one corrected by hand."""
    shift = 0.0 if version >= 1.1 else 0.5
    kind = np.dtype(
        {
            "names": [
                "instance_id", "instance_type", "frame_id", "skeleton", "track", "from_predicted",
                "score", "point_id_start", "point_id_end", "tracking_score",
            ],
            "formats": ["i8", "u1", "u8", "u4", "i4", "i8", "f4", "u8", "u8", "f4"],
        }
    )  # fmt: skip
    point = [("x", "f8"), ("y", "f8"), ("visible", "?"), ("complete", "?")]
    frames, instances, points, predicted = [], [], [], []
    for k in range(FRAMES):
        first = len(instances)
        for who in range(len(tracks) or 1):
            wrong = 300.0 if k < 3 and who == 0 else 0.0
            at = len(predicted)
            place = (PIXELS[k] if who == 0 else PIXELS[FRAMES - 1 - k] + 50.0) + wrong + shift
            predicted += [(x, y, True, False, 0.9) for x, y in place]
            row = (len(instances), 1, 7 + k, 0, who if tracks else -1, -1, 0.9, at, at + 11, 0.0)
            instances.append(row)
        if k < 3:
            at = len(points)
            points += [(x, y, True, True) for x, y in PIXELS[k] + shift]
            row = (len(instances), 0, 7 + k, 0, 0 if tracks else -1, first, 0.0, at, at + 11, 0.0)
            instances.append(row)
        frames.append((7 + k, 0, k, first, len(instances)))
    backwards = list(reversed(range(11)))  # the skeleton need not name its nodes in their order
    about = {
        "skeletons": [{"nodes": [{"id": k} for k in backwards]}],
        "nodes": [{"name": NODES[10 - k]} for k in range(11)],
    }
    with h5py.File(path, "w") as file:
        group = file.create_group("metadata")
        group.attrs["format_id"] = version
        group.attrs["json"] = np.bytes_(json.dumps(about))
        names = [json.dumps([0, name]) for name in tracks]
        file["tracks_json"] = np.array(names, dtype="S") if names else np.zeros(0, dtype="S1")
        file["videos_json"] = np.array([json.dumps({"backend": {"fps": RATE_HZ}})], dtype="S")
        columns = ["frame_id", "video", "frame_idx", "instance_id_start", "instance_id_end"]
        formats = ["u8", "u4", "u8", "u8", "u8"]
        layout = np.dtype({"names": columns, "formats": formats})
        file["frames"] = np.array(frames, dtype=layout)
        file["instances"] = np.array(instances, dtype=kind)
        file["points"] = np.array(points, dtype=point)
        file["pred_points"] = np.array(predicted, dtype=[*point, ("score", "f8")])


def qtm(path: Path, *, titles: bool) -> None:
    """Markers in the xz plane of a tank on its side, mm, seen from the end of y; away from 0."""
    place = np.stack([BODY[..., 0], np.full(BODY.shape[:2], 5.0), -BODY[..., 1]], axis=2)
    place[4, 3] = 0.0
    head = [f"NO_OF_FRAMES\t{FRAMES}", f"NO_OF_MARKERS\t{len(NODES)}", f"FREQUENCY\t{RATE_HZ:g}"]
    head += ["DATA_INCLUDED\t3D", "\t".join(["MARKER_NAMES", *NODES])]
    if titles:
        head.append("\t".join(["Frame", "Time", *(f"{n} {a}" for n in NODES for a in "XYZ")]))
    lines = [
        "\t".join([*([str(k + 1), f"{k / RATE_HZ:.5f}"] if titles else []), *map(repr, row)])
        for k, row in enumerate(place.reshape(FRAMES, -1).tolist())
    ]
    path.write_text("\n".join([*head, *lines]) + "\n")


def test_the_animal_is_chosen_and_who_is_in_the_file_is_told(tmp_path: Path) -> None:
    two_dlc(tmp_path / "two.csv")
    project(tmp_path / "two.slp")
    held = wcon()
    other = [record | {"id": "other", "t": record["t"] + 9.0} for record in held["data"]]
    for record in held["data"]:
        record["id"] = "eel"
    (tmp_path / "two.wcon").write_text(json.dumps(held | {"data": held["data"] + other}))
    table = ["track,frame_idx," + ",".join(f"{n}.{c}" for n in NODES for c in ("x", "y", "score"))]
    for who, way in (("eel", 1), ("other", -1)):
        for k, body in enumerate(PIXELS[::way]):
            table.append(f"{who},{k}," + ",".join(f"{x!r},{y!r},0.9" for x, y in body.tolist()))
    (tmp_path / "sleap.csv").write_text("\n".join(table) + "\n")
    for name in ("two.csv", "two.slp", "two.wcon", "sleap.csv"):
        with pytest.raises(InputError, match=r"2 animals in it \(eel, other\): give --individual"):
            load_file(tmp_path / name)
        with pytest.raises(InputError, match=r"no such animal; in it are eel, other"):
            load_file(tmp_path / name, choice=Choice(individual="trout"))
        scale = 0.08 if name == "two.wcon" else None
        same(load_file(tmp_path / name, EEL.model_copy(update={"rate": RATE_HZ})), length_m=scale)
        backwards = load_file(tmp_path / name, OTHER.model_copy(update={"rate": RATE_HZ}))
        assert backwards.frames == FRAMES
    assert not load_file(tmp_path / "two.slp", choice=EEL).rate_assumed, "the project states it"


def test_a_project_of_an_older_format_and_one_without_tracks(tmp_path: Path) -> None:
    project(tmp_path / "new.slp")
    project(tmp_path / "old.slp", version=1.0)
    project(tmp_path / "lone.slp", tracks=())
    new, old = (load_file(tmp_path / f"{n}.slp", choice=EEL) for n in ("new", "old"))
    assert np.allclose(new.points, old.points), "half a pixel between the formats"
    assert np.allclose(load_file(tmp_path / "lone.slp").points, new.points)


def test_keypoints_are_taken_in_the_order_that_is_said(tmp_path: Path) -> None:
    project(tmp_path / "two.slp")
    path = tmp_path / "two.slp"
    turned = load_file(path, choice=Choice(individual="eel", keypoints=tuple(reversed(NODES))))
    plain = load_file(path, choice=EEL)
    assert np.allclose(turned.points[:, ::-1], plain.points)
    some = load_file(path, choice=Choice(individual="eel", keypoints=tuple(NODES[::2])))
    assert some.points.shape[1] == 6
    for names, told in (
        (("p0", "p1", "nose", "p3"), "it has no nose; it has p0, p1"),
        (("p0", "p1"), "4 or more names"),
        (("p0", "p1", "p1", "p2"), "each once"),
    ):
        with pytest.raises(InputError, match=told):
            load_file(path, choice=Choice(individual="eel", keypoints=names))


def test_one_missing_keypoint_does_not_drop_the_frame_and_its_verdict_says_so(
    tmp_path: Path,
) -> None:
    places = BODY.copy()
    for k, lost in enumerate(([0], [5], [10], [3, 7], [3, 4], list(range(9)))):
        places[2 * k, lost] = np.nan
    out, set_ = bridge(places)
    assert np.flatnonzero(set_).tolist() == [0, 2, 4, 6]
    off = np.hypot(*(out - BODY)[set_].transpose(2, 0, 1)) / 80.0
    assert off[1].max() < 0.01, "between others"
    assert off.max() < 0.04, "at an end"
    for k in (8, 10):
        assert np.isnan(out[k]).any(), "too many, or neighbours"
    qtm(tmp_path / "m.tsv", titles=True)
    track = load_file(tmp_path / "m.tsv", choice=Choice(plane="xz"))
    assert (track.bridged, track.dropped) == (1, 0)
    assert track.status[4] is FrameStatus.BRIDGED
    save_track(tmp_path / "kept.npz", track)
    kept = load_track(str(tmp_path / "kept.npz"))
    assert kept.status == track.status
    assert not kept.rate_assumed


def test_a_rate_that_was_taken_stays_marked_in_the_file(tmp_path: Path) -> None:
    np.savez(tmp_path / "s.npz", skeletons=PIXELS)
    first = load_file(tmp_path / "s.npz")
    assert first.rate_assumed
    save_track(tmp_path / "t.npz", first)
    assert load_file(tmp_path / "t.npz").rate_assumed
    assert not load_file(tmp_path / "t.npz", Choice(rate=25.0)).rate_assumed


def test_markers_in_space_are_projected(tmp_path: Path) -> None:
    for titles in (True, False):
        qtm(tmp_path / "m.tsv", titles=titles)
        same(load_file(tmp_path / "m.tsv", choice=Choice(plane="xz")), length_m=0.08)


def test_c3d_markers(tmp_path: Path) -> None:
    ezc3d = pytest.importorskip("ezc3d", reason="the extra c3d is not installed")
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [RATE_HZ]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["LABELS"]["value"] = NODES
    data = np.ones((4, len(NODES), FRAMES))
    data[:2] = BODY.transpose(2, 1, 0)
    file["data"]["points"] = data
    file.write(str(tmp_path / "m.c3d"))
    same(load_file(tmp_path / "m.c3d"), length_m=0.08)


def test_options_that_a_file_has_no_use_for_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "s.npz", skeletons=PIXELS)
    with pytest.raises(InputError, match=r"--individual: an \.npz names no animals"):
        load_file(tmp_path / "s.npz", choice=EEL)
    with pytest.raises(InputError, match="--keypoints: a shipped recording names no keypoints"):
        load_track("worm-like", choice=Choice(keypoints=tuple("abcd")))


def test_units_of_a_wcon_may_differ(tmp_path: Path) -> None:
    held = wcon()
    for record in held["data"]:
        record["y"] = [1000.0 * y for y in record["y"]]
    held["units"]["y"] = "um"
    (tmp_path / "a.wcon").write_text(json.dumps(held))
    same(load_file(tmp_path / "a.wcon"), length_m=0.08)
