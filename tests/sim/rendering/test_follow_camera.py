"""The camera of a film: all of a body is in the picture, and no hill hides it."""

from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.sim.rendering.follow_camera import (
    BEHIND_DEG,
    BESIDE_DEG,
    ELEVATIONS_DEG,
    LEVEL,
    BodyTrack,
    distance_to_show,
    follow,
    hidden,
)

FPS, FRAMES, LENGTH_M = 25, 200, 1.0
FOVY_DEG, ASPECT = 45.0, 16.0 / 9.0


def crawl(legs: str = "none", z_m: float = 0.05) -> BodyTrack:
    """A straight body that crawls along x for 4 m; legs reach 0.4 m ``aside`` or ``down``."""
    way = np.linspace(0.0, 4.0, FRAMES)[:, None]
    spine = np.zeros((FRAMES, 11, 3))
    spine[..., 0], spine[..., 2] = way - np.linspace(0.0, LENGTH_M, 11), z_m
    parts = spine
    if legs != "none":
        feet = spine[:, [2, 2, 8, 8]].copy()
        if legs == "aside":
            feet[..., 1] += [0.4, -0.4, 0.4, -0.4]
        else:
            spine[..., 2] += 0.4
            feet[..., 1] += [0.05, -0.05, 0.05, -0.05]
        parts = np.concatenate([spine, feet], axis=1)
    return BodyTrack(parts, 11, LENGTH_M, FPS, FOVY_DEG, ASPECT)


def picture(track: BodyTrack, camera: Floats) -> Floats:
    """(F, P, 2) places in the picture by a pinhole, -1 to 1 across and upwards."""
    turn, down = np.radians(camera[:, 3]), np.radians(camera[:, 4])
    ahead = np.stack([np.cos(down) * np.cos(turn), np.cos(down) * np.sin(turn), -np.sin(down)], 1)
    right = np.stack([np.sin(turn), -np.cos(turn), 0.0 * turn], 1)
    eye = camera[:, :3] - camera[:, 5:] * ahead
    off = track.parts_m - eye[:, None]
    depth = (off * ahead[:, None]).sum(axis=-1)
    half = np.tan(np.radians(0.5 * FOVY_DEG))
    across = (off * right[:, None]).sum(axis=-1) / (depth * half * ASPECT)
    upward = (off * np.cross(right, ahead)[:, None]).sum(axis=-1) / (depth * half)
    return np.stack([across, upward], axis=-1)


def wall(y_m: float, height_m: float) -> HeightField:
    """A wall along x with its middle at ``y_m``, 0.4 m thick."""
    y = np.arange(-6.0, 6.01, 0.1)
    z = np.where(np.abs(y - y_m) < 0.2, height_m, 0.0)[:, None]
    return HeightField(np.repeat(z, 161, axis=1), 0.1, -6.0, -6.0)


@pytest.mark.parametrize("legs", ["none", "aside", "down"])
def test_every_bone_is_in_the_picture_from_the_first_frame(legs: str) -> None:
    track = crawl(legs)
    camera = follow(track, None)
    assert np.abs(picture(track, camera)).max() < 0.9
    assert np.abs(picture(track, camera)[[0, -1]].mean(axis=1)).max() < 0.25  # in the middle
    far = track.parts_m.copy()
    far[:40, -1] += [0.0, 2.5, 0.0]  # a limb that reaches far out at the start
    stretched = replace(track, parts_m=far)
    assert np.abs(picture(stretched, follow(stretched, None))).max() < 0.95
    near = camera.copy()
    near[:, 5] = distance_to_show(track, near)
    assert np.abs(picture(track, near)).max() == pytest.approx(0.75, abs=0.15)


def test_a_body_on_legs_is_seen_from_the_side_and_a_lying_one_from_behind() -> None:
    for lying in (crawl(), crawl("aside")):
        assert not lying.is_upright
        assert follow(lying, None)[:, 3] == pytest.approx(BEHIND_DEG[0])
        assert follow(lying, None)[:, 4] == pytest.approx(LEVEL)
    legged = follow(crawl("down"), None)
    assert crawl("down").is_upright
    assert legged[:, 3] == pytest.approx(BESIDE_DEG[0])
    assert legged[:, 4] == pytest.approx(ELEVATIONS_DEG[0])
    assert abs(np.cos(np.radians(BESIDE_DEG[0]))) < 0.5  # nearer to the side than to the front


def test_hidden_by_a_wall() -> None:
    ground = wall(0.0, 1.0)
    eyes = np.array([[0.0, -2.0, 0.5], [0.0, -2.0, 3.0], [0.0, -2.0, 0.5]])
    targets = np.array([[0.0, 2.0, 0.1], [0.0, 2.0, 0.1], [0.0, -1.0, 0.1]])
    assert hidden(eyes, targets, ground).tolist() == [True, False, False]


def eye_m(camera: Floats) -> Floats:
    turn, down = np.radians(camera[:, 3]), np.radians(camera[:, 4])
    ahead = np.stack([np.cos(down) * np.cos(turn), np.cos(down) * np.sin(turn), -np.sin(down)], 1)
    return np.asarray(camera[:, :3] - camera[:, 5:] * ahead)


def test_a_wall_beside_the_body_is_looked_over_or_around() -> None:
    """The camera of a snake stands behind it and to its right, at y below 0."""
    track = crawl()
    plain = follow(track, None)
    for height_m, y_m in ((0.6, -0.45), (2.5, -0.45), (2.5, 0.45)):
        ground = wall(y_m, height_m)
        shown = track.parts_m[:, ::5]
        sight = np.broadcast_to(eye_m(plain)[:, None], shown.shape)
        before = hidden(sight, shown, ground).mean()
        camera = follow(track, ground)
        after = hidden(np.broadcast_to(eye_m(camera)[:, None], shown.shape), shown, ground)
        assert (before > 0.3) == (y_m < 0.0)
        assert not after.any()


def test_a_ravine_with_two_walls_is_seen_from_above() -> None:
    track = crawl()
    y = np.arange(-6.0, 6.01, 0.1)
    z = np.where(np.abs(y) > 0.6, 2.0, 0.0)[:, None]
    ground = HeightField(np.repeat(z, 161, axis=1), 0.1, -6.0, -6.0)
    camera = follow(track, ground)
    shown = track.parts_m[:, ::5]
    assert not hidden(np.broadcast_to(eye_m(camera)[:, None], shown.shape), shown, ground).any()
    assert np.abs(np.diff(camera, axis=0)).max(axis=0)[3:] == pytest.approx(0.0, abs=2.0)
