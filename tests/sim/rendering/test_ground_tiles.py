"""Ground with detail by distance: it is the field, without gaps, and nothing in view is missing."""

import numpy as np
import pytest
import trimesh

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.sim.rendering.crowd_film import FOVY_DEG, CrowdShot, CrowdView
from snakewalk.sim.rendering.ground_tiles import (
    CELLS,
    MOST_PIXELS,
    STEPS,
    GroundTiles,
)
from snakewalk.sim.rendering.view_frustum import ViewFrustum

SIZE_PX = 320, 180


def hills(rows: int = 75, columns: int = 100) -> HeightField:
    """Waves of 0.5 m to 3 m on a field whose tiles are not all complete."""
    y, x = np.meshgrid(0.1 * np.arange(rows), 0.1 * np.arange(columns), indexing="ij")
    z = 0.2 * np.sin(2.0 * x) * np.cos(1.7 * y) + 0.02 * np.sin(11.0 * x + 5.0 * y)
    return HeightField(z, 0.1, -5.0, -3.7)


def view(azimuth_deg: float, elevation_deg: float = -25.0) -> ViewFrustum:
    """A camera on the orbit of a point in the field, without MuJoCo's formula."""
    turn, rise = np.radians([azimuth_deg, elevation_deg])
    ahead = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
    up = np.array([-np.sin(rise) * np.cos(turn), -np.sin(rise) * np.sin(turn), np.cos(rise)])
    eye = np.array([0.5, 0.2, 0.1]) - 2.0 * ahead
    half = float(np.tan(np.radians(0.5 * FOVY_DEG)))
    axes = np.array([ahead, np.cross(ahead, up), up])
    return ViewFrustum(eye, axes, (half * SIZE_PX[0] / SIZE_PX[1], half), SIZE_PX[1])


def test_every_level_covers_the_field_and_states_its_error() -> None:
    ground = hills()
    tiles = GroundTiles(ground)._tiles
    assert len(tiles) == -(-74 // CELLS) * -(-99 // CELLS)
    for level in range(len(STEPS)):
        area = 0.0
        for levels in tiles:
            one = levels[level]
            solid = trimesh.Trimesh(one.corners_m, one.faces, process=False)
            top = solid.face_normals[:, 2] > 1e-6
            flat = solid.triangles[top][..., :2]
            edge_a, edge_b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
            area += 0.5 * float((edge_a[:, 0] * edge_b[:, 1] - edge_a[:, 1] * edge_b[:, 0]).sum())
            middle = solid.triangles_center[top]
            off = np.abs(middle[:, 2] - ground.elevation_m(middle[:, 0], middle[:, 1]))
            # a cell is split along a diagonal, the error is that of its sides
            assert off.max() <= one.error_m + 0.012
        assert area == pytest.approx(np.prod(ground.size_m))
    errors = np.array([[one.error_m for one in levels] for levels in tiles])
    assert errors[:, 0].max() == pytest.approx(0.0, abs=1e-12)
    assert (np.diff(errors, axis=1) >= 0.0).all()
    assert errors[:, -1].min() > 0.02


def test_skirts_reach_below_the_neighbours_of_any_level() -> None:
    ground = hills()
    for levels in GroundTiles(ground)._tiles:
        lowest = max(one.error_m for one in levels)
        for one in levels:
            ground_m = ground.elevation_m(one.corners_m[:, 0], one.corners_m[:, 1])
            assert (ground_m - one.corners_m[:, 2]).max() >= 2.0 * lowest


@pytest.mark.parametrize("azimuth_deg", [0.0, 70.0, 160.0, 250.0, 330.0])
def test_every_sample_in_the_picture_is_in_a_tile_that_is_shown(azimuth_deg: float) -> None:
    ground, eye = hills(), view(azimuth_deg)
    tiles = GroundTiles(ground)
    shown = eye.touches(tiles._middle_m, tiles._radius_m)
    for is_shown, levels in zip(shown, tiles._tiles, strict=True):
        off = levels[0].corners_m - eye.eye_m
        ahead, right, up = eye.axes
        depth = off @ ahead
        across, upward = (
            np.abs(off @ axis) / half for axis, half in zip((right, up), eye.half_tan, strict=True)
        )
        inside = (depth > 0.0) & (across < depth) & (upward < depth)
        assert is_shown or not inside.any()
    assert not shown.all()


@pytest.mark.slow
def test_the_picture_is_that_of_the_complete_field() -> None:
    robot, world, ground = load_robot("yaw16"), load_world("flat"), hills()
    shot = CrowdShot(np.array([0.5, 0.2, 0.1]), 2.0, 70.0, -25.0, [], "")
    pictures = []
    for tiled in (False, True):
        crowd = CrowdView(robot, world, ground, 1, SIZE_PX, tiled=tiled)
        try:
            pictures.append(crowd.draw(shot).astype(int))
            faces = [int(crowd._model.geom_group[k]) == 0 for k in range(crowd._model.ngeom)]
        finally:
            crowd.close()
    assert 3 < sum(faces) < len(faces) / 3
    sky = [picture[..., 2] > picture[..., 1] + 15 for picture in pictures]
    assert 0.05 < sky[0].mean() < 0.6
    assert (sky[0] != sky[1]).mean() < 0.01  # the horizon moves by less than two pixels
    assert np.abs(pictures[0] - pictures[1]).mean() < 8.0  # flat cells, or smooth shading


def test_near_tiles_are_finer_than_far_ones() -> None:
    robot, world, ground = load_robot("yaw16"), load_world("flat"), hills()
    crowd = CrowdView(robot, world, ground, 1, SIZE_PX)
    try:
        crowd.draw(CrowdShot(np.array([-3.0, 0.0, 0.1]), 1.0, 0.0, -20.0, [], ""))
        model, tiles = crowd._model, crowd._tiles
        assert tiles is not None
        eye = ViewFrustum.orbit(
            *(np.array([-3.0, 0.0, 0.1]), 1.0, 0.0, -20.0), fovy_deg=FOVY_DEG, size_px=SIZE_PX
        )
        rows = np.argwhere(model.geom_group[tiles._geoms] == 0)
        assert {int(level) for _, level in rows} > {0}
        for tile, level in rows:
            away = np.linalg.norm(tiles._middle_m[tile] - eye.eye_m) - tiles._radius_m[tile]
            pixels = tiles._error_m[tile, level] / (max(away, 1e-9) * eye.pixel_rad)
            assert level == 0 or pixels <= MOST_PIXELS
    finally:
        crowd.close()
