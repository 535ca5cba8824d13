"""BVH skeletons: joints by forward kinematics give back the body of a known wave."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import load_file
from tests.helpers.travelling import FRAMES, RATE_HZ, wave_angles

JOINTS = 20
SEGMENTS = wave_angles().reshape(FRAMES, JOINTS, 100 // JOINTS).mean(axis=2)


def bvh(path: Path, *, jaw: bool = False) -> None:
    """A chain along -x in the plane of x and z, y up; rotations about y."""
    lines, depth = ["HIERARCHY", "ROOT head", "{", "OFFSET 0 0 0"], 1
    lines.append("CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation")
    if jaw:
        lines += ["JOINT jaw", "{", "OFFSET 1 0 0", "CHANNELS 1 Zrotation", "End Site", "{"]
        lines += ["OFFSET 1 0 0", "}", "}"]
    for k in range(1, JOINTS):
        lines += [f"JOINT s{k}", "{", "OFFSET -5 0 0", "CHANNELS 3 Zrotation Xrotation Yrotation"]
        depth += 1
    lines += ["End Site", "{", "OFFSET -5 0 0", "}", *["}"] * depth]
    lines += ["MOTION", f"Frames: {FRAMES}", f"Frame Time: {1.0 / RATE_HZ}"]
    turns = np.degrees(np.diff(SEGMENTS, axis=1, prepend=0.0))
    for k, row in enumerate(turns):
        root = [0.1 * k, 3.0, 0.0, 0.0, 0.0, row[0]]
        rest = [v for turn in row[1:] for v in (0.0, 0.0, turn)]
        lines.append(" ".join(f"{v:.8f}" for v in [*root, *([0.0] if jaw else []), *rest]))
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("jaw", [False, True])
def test_a_skeleton_gives_back_its_wave(jaw: bool, tmp_path: Path) -> None:
    bvh(tmp_path / "a.bvh", jaw=jaw)
    track = load_file(tmp_path / "a.bvh")
    assert (track.frames, track.length_m) == (FRAMES, None)
    assert track.rate_hz == pytest.approx(RATE_HZ)
    assert np.abs(track.angles_rad - wave_angles())[:, 5:-5].max() < 0.06
    assert track.points[-1, 0, 0] == pytest.approx(0.1 * (FRAMES - 1) / 100.0, rel=1e-2)
    left_out = (
        "2 joints outside the longest chain are left out: jaw, jaw_end; --keypoints uses them"
    )
    assert (left_out in track.notes) is jaw
    assert "head is taken as the head; --keypoints gives another order" in track.notes


def test_another_order_and_plane(tmp_path: Path) -> None:
    bvh(tmp_path / "a.bvh")
    order = tuple(f"s{k}" for k in range(JOINTS - 1, 0, -1))
    turned = load_file(tmp_path / "a.bvh", choice=Choice(keypoints=order))
    assert np.cos(turned.angles_rad.mean() - wave_angles().mean()) == pytest.approx(-1.0, abs=0.05)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text[: text.index("MOTION")], "has no MOTION"),
        (lambda text: text[:-400], "and has .* values; export it again"),
        (lambda text: text.replace("Frame Time: 0.05", "Frame Time: 0"), "Frame Time: S above 0"),
        (lambda text: text.replace("Xrotation", "Wrotation", 1), "channel WROTATION"),
        (lambda text: text.replace("OFFSET -5 0 0", "OFFSET -5 left 0", 1), "damaged near word"),
        (lambda text: text.replace("Frames: 60", "Frames: 900000000"), "give a part|export it"),
    ],
)
def test_faults_are_one_line(change: Callable[[str], str], said: str, tmp_path: Path) -> None:
    bvh(tmp_path / "a.bvh")
    (tmp_path / "a.bvh").write_text(change((tmp_path / "a.bvh").read_text()))
    with pytest.raises(InputError, match=said):
        load_file(tmp_path / "a.bvh")


def test_damaged_tables_of_markers_and_skeletons_end_in_one_line(tmp_path: Path) -> None:
    from tests.controller.track.readers.test_marker_tables import BODY, NODES, trc, vicon

    rng = np.random.default_rng(0)
    bvh(tmp_path / "a.bvh")
    trc(tmp_path / "t.trc", NODES, BODY)
    vicon(tmp_path / "v.csv", NODES, BODY)
    for name in ("a.bvh", "t.trc", "v.csv"):
        whole = (tmp_path / name).read_bytes()
        for _ in range(30):
            data = bytearray(whole)
            for at in rng.integers(0, min(len(data), 1500), 3):
                data[at] = rng.integers(9, 127)
            cut = rng.integers(1, len(data)) if rng.random() < 0.3 else len(data)
            (tmp_path / name).write_bytes(data[:cut])
            faults: tuple[str, ...] = ("",)
            try:
                load_file(tmp_path / name)
            except InputError as error:
                faults = error.faults
            assert len(faults) == 1
