"""The texture of a skin from several photographs, against a cylinder whose colours are known."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from snakewalk.config.arrays import Floats
from snakewalk.controller.animals.mesh.body_model import BodyModel, spindle, straight
from snakewalk.controller.animals.mesh.body_skin import Cut, model_skin
from snakewalk.controller.animals.mesh.mesh import body_mesh, picture_around
from snakewalk.controller.animals.mesh.photographs import (
    VIEWS,
    Photograph,
    PictureAround,
    blend,
    row_turn_rad,
)
from snakewalk.controller.animals.mesh.skin_texture import ALONG
from tests.helpers.command import snakewalk

LENGTH_PX, RADIUS_PX = 400.0, 40.0
CYLINDER = BodyModel(np.full(101, 0.1), np.full(101, 0.1), 1.0, measured=True)
LINE = np.stack([450.0 - np.linspace(0.0, LENGTH_PX, 41), np.full(41, 60.0)], axis=-1)
RADII = np.full(41, RADIUS_PX)


def known(s: Floats, turn: Floats) -> Floats:
    """Colour of the cylinder: waves along it and around it, different on each side."""
    red = 120.0 + 60.0 * np.cos(turn)
    green = 120.0 + 60.0 * np.sin(turn)
    blue = 120.0 + 40.0 * np.cos(6.0 * np.pi * s) + 20.0 * np.cos(2.0 * turn + 0.4)
    return np.stack(np.broadcast_arrays(red, green, blue), axis=-1)


def photograph(view: str, gain: float | tuple[float, ...] = 1.0) -> Photograph:
    """The cylinder in parallel projection, head to the right; what lies beside it is white."""
    x, y = np.meshgrid(np.arange(501.0), np.arange(121.0))
    across = (60.0 - y) / RADIUS_PX  # facing right, the left of the heading is up in the picture
    inside = (np.abs(across) <= 1.0) & (x >= 50.0) & (x <= 450.0)
    # on a circle: the left of the heading is a quarter turn before the camera
    turn = VIEWS[view] - 0.5 * np.pi + np.arccos(np.clip(across, -1.0, 1.0))
    colour = np.clip(known((450.0 - x) / LENGTH_PX, turn) * np.asarray(gain), 0.0, 255.0)
    image = np.where(inside[..., None], colour, 255.0)
    return Photograph(np.rint(image).astype(np.uint8), LINE, RADII, VIEWS[view])


def error(made: PictureAround, low_deg: float, high_deg: float) -> float:
    """Largest difference from the known colours between two angles, away from the tips."""
    turn = row_turn_rad()
    off = made.picture - known(np.linspace(0.0, 1.0, ALONG)[None], turn[:, None])
    degrees = (np.degrees(turn) + 180.0) % 360.0 - 180.0
    rows = (degrees > low_deg) & (degrees < high_deg)
    return float(np.abs(off[rows][:, 8:-8]).max())


def test_two_photographs_give_the_known_colours_back() -> None:
    made = blend([photograph("top"), photograph("left", 0.7)], CYLINDER)
    assert made.gains[0] == (1.0, 1.0, 1.0)
    assert made.gains[1] == pytest.approx((1.0 / 0.7,) * 3, rel=0.01)
    # the back and the left side, to 75 degrees off either camera
    assert made.seen == pytest.approx(240.0 / 360.0, abs=0.01)
    assert error(made, -60.0, 150.0) < 4.0
    assert error(made, -73.0, 163.0) < 10.0


def test_a_wrong_side_or_unmatched_brightness_would_be_noticed() -> None:
    top, left = photograph("top"), photograph("left", 0.7)
    swapped = Photograph(left.image, left.points_px, left.radius_px, VIEWS["right"])
    assert error(blend([top, swapped], CYLINDER), -60.0, 150.0) > 40.0
    dark = blend([left, top], CYLINDER)  # matched to the first, which is the dark one
    assert dark.gains[1] == pytest.approx((0.7,) * 3, rel=0.01)
    assert error(dark, -60.0, 150.0) > 30.0


def test_four_photographs_of_different_tints_cover_everything() -> None:
    tints = {
        "top": (1.0,) * 3,
        "left": (0.8, 1.0, 1.1),
        "right": (1.1, 0.9, 1.0),
        "below": (0.6,) * 3,
    }
    made = blend([photograph(view, tint) for view, tint in tints.items()], CYLINDER)
    for gain, tint in zip(made.gains, tints.values(), strict=True):
        assert gain == pytest.approx(1.0 / np.array(tint), rel=0.02)
    assert made.seen == 1.0
    assert error(made, -180.0, 180.0) < 5.0


def test_unseen_skin_is_the_mirrored_picture_and_counts_as_unseen() -> None:
    made = blend([photograph("top"), photograph("left")], CYLINDER)
    turn = np.degrees(row_turn_rad())
    belly = int(np.abs(turn - 225.0).argmin())  # under the right side
    back = int(np.abs(turn - 135.0).argmin())
    picture = made.picture.astype(float)
    np.testing.assert_allclose(picture[belly], picture[back], atol=3.0)
    alone = blend([photograph("top")], CYLINDER)
    assert alone.seen == pytest.approx(150.0 / 360.0, abs=0.01)
    assert np.abs(np.diff(alone.picture.astype(float), axis=0)).max() < 12.0  # no seam anywhere


def test_opposite_photographs_share_nothing_and_are_not_matched() -> None:
    made = blend([photograph("left"), photograph("right", 0.7)], CYLINDER)
    assert made.gains == ((1.0, 1.0, 1.0), None)
    joined = blend([photograph("left"), photograph("right", 0.7), photograph("top")], CYLINDER)
    assert joined.gains[1] == pytest.approx((1.0 / 0.7,) * 3, rel=0.01)


def test_an_ellipse_is_sampled_where_its_skin_is() -> None:
    """A flat body: a point at angle t of the ellipse lies at a cos t, b sin t."""
    flat = BodyModel(np.full(101, 0.1), np.full(101, 0.05), 1.0, measured=True)
    made = blend([photograph("top"), photograph("left")], flat)
    assert error(made, -30.0, 120.0) < 5.0


def test_the_mesh_is_split_at_the_belly_only() -> None:
    plain = body_mesh(spindle(1.0), straight())
    mesh, source = picture_around(plain)
    np.testing.assert_array_equal(mesh.vertices, plain.vertices[source])
    np.testing.assert_array_equal(mesh.normals, plain.normals[source])
    added = mesh.vertices[len(plain.vertices) :]
    np.testing.assert_allclose(added[:, 1:], 0.0, atol=1e-9)
    v = mesh.uv[mesh.faces][..., 1]
    fans = np.isin(mesh.faces, [len(plain.vertices) - 2, len(plain.vertices) - 1]).any(axis=1)
    assert np.ptp(v[~fans], axis=1).max() <= 1.0 / 32.0 + 1e-9
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    solid.merge_vertices(merge_tex=True, merge_norm=True)
    assert solid.is_watertight
    left = mesh.vertices[np.abs(mesh.uv[:, 1] - 0.25) < 1e-9]
    assert left[:, 1].min() > 0.0


def test_a_moving_skin_carries_the_split_corners() -> None:
    made = model_skin(
        spindle(1.0), np.zeros((256, 512, 3), np.uint8), "x", Cut(curves=12), around=True
    )
    plain = model_skin(spindle(1.0), None, "x", Cut(curves=12)).skin
    skin = made.skin
    assert len(skin.along) == len(skin.mesh.vertices) > len(plain.along)
    np.testing.assert_allclose(skin.along[len(plain.along) :], skin.mesh.uv[len(plain.along) :, 0])


def write_views(folder: Path) -> list[str]:
    """Tracks and photographs of two views; the words of the command."""
    for name in ("top", "side"):
        np.savez(
            folder / f"{name}.npz",
            points_px=np.stack([LINE, LINE]),
            radius_px=np.stack([RADII] * 2),
        )
    for view, gain in (("top", 1.0), ("left", 0.7), ("right", 1.0)):
        Image.fromarray(photograph(view, gain).image).save(folder / f"{view}.png")
    return ["animal", "body", "top.npz", "--side", "side.npz", "--json"]


@pytest.mark.slow
def test_the_command_reports_what_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = [*write_views(tmp_path), "--image", "top.png", "--image", "left=left.png"]
    done = snakewalk(*words, "-o", "b.glb", "--picture", "b.png", "--frame", "1", "--frame", "0")
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert facts["texture"] == ["top.png", "left.png"]
    assert facts["texture_seen"] == pytest.approx(2.0 / 3.0, abs=0.01)
    assert facts["texture_gains"][1] == pytest.approx([1.0 / 0.7] * 3, rel=0.02)
    assert Path("b.png").stat().st_size > 10_000
    moved = snakewalk(*words, "-o", "m.glb", "--animate", "anguilliform", "--curves", "12")
    assert moved.returncode == 0, moved.stderr
    assert json.loads(moved.stdout)["texture_seen"] == facts["texture_seen"]
    apart = ["--image", "left=left.png", "--image", "right=right.png", "-o", "c.glb"]
    done = snakewalk(*words[:5], *apart)
    assert done.returncode == 0
    assert "right.png: shows no part of the body that left.png" in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("--image", "front=top.png"), "the view is one of left, top, right, below, not front"),
        (("--image", "left=none.png"), "none.png: no such file"),
        (("--image", "top.png", "--frame", "0", "--frame", "1"), "2 frames and 1 images"),
        (("--image", "right=right.png", "--frame", "5"), "right.png: frame 5 is not in 0..1"),
    ],
)
def test_wrong_photographs_are_rejected(
    words: tuple[str, ...], fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = snakewalk(*write_views(tmp_path), *words, "-o", "b.glb")
    assert done.returncode == 2
    assert fault in " ".join(done.stderr.split())


def test_a_side_photograph_needs_its_track(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_views(tmp_path)
    done = snakewalk("animal", "body", "top.npz", "--image", "left=left.png", "-o", "b.glb")
    assert done.returncode == 2
    assert "a photograph from the left needs the skeletons in it" in " ".join(done.stderr.split())
