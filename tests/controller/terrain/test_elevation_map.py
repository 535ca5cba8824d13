"""Maps from points, triangles and rasters: closed forms, holes, limits."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.terrain.elevation_map import ElevationMap, filled

RNG = np.random.default_rng(3)


def plane(x, y):
    return 0.3 * x - 0.2 * y + 1.0


def test_a_plane_with_a_hole_is_filled_to_the_plane() -> None:
    x, y = np.meshgrid(np.arange(60.0), np.arange(40.0))
    z = plane(x, y)
    hole = np.hypot(x - 30, y - 20) < 12
    found = filled(np.where(hole, np.nan, z), hole)
    np.testing.assert_allclose(found, z, atol=1e-3)
    np.testing.assert_array_equal(found[~hole], z[~hole])


def test_the_fill_is_the_mean_of_its_neighbours_and_keeps_their_range() -> None:
    z = RNG.normal(size=(30, 30))
    hole = np.zeros((30, 30), bool)
    hole[5:20, 8:21] = True
    found = filled(np.where(hole, np.nan, z), hole)
    around = found[:-2, 1:-1] + found[2:, 1:-1] + found[1:-1, :-2] + found[1:-1, 2:]
    inner = hole[1:-1, 1:-1]
    np.testing.assert_allclose(found[1:-1, 1:-1][inner], (around / 4)[inner], atol=1e-4)
    assert z.min() <= found.min()
    assert found.max() <= z.max()


@pytest.mark.parametrize(
    ("height", "expected"), [("lowest", 1.0), ("median", 2.5), ("highest", 9.0)]
)
def test_of_the_points_in_a_cell_one_counts(height, expected) -> None:
    corners = [(0.0, 0.0, 5.0), (2.0, 0.0, 5.0), (0.0, 2.0, 5.0), (2.0, 2.0, 5.0)]
    cell = [(1.1, 0.9, z) for z in (1.0, 2.0, 3.0, 9.0)]
    found = ElevationMap.of_points(np.array(corners + cell), 1.0, height)
    assert found.z_m[1, 1] == expected
    assert found.known.sum() == 5
    assert ElevationMap.of_points(np.array(corners + cell), 1.0, height, least=2).known.sum() == 1


def test_points_of_a_plane_lie_on_their_samples() -> None:
    x, y = np.meshgrid(np.arange(-1.0, 1.01, 0.25), np.arange(3.0, 4.01, 0.25))
    points = np.stack([x, y, plane(x, y)], axis=-1).reshape(-1, 3)
    found = ElevationMap.of_points(RNG.permutation(points), 0.25)
    assert (found.x0_m, found.y0_m) == (-1.0, 3.0)
    np.testing.assert_allclose(found.z_m, plane(x, y))


def test_the_highest_surface_of_a_mesh_counts_and_beside_it_is_a_hole() -> None:
    def sheet(x0, x1, y0, y1, lift):
        corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        return np.column_stack([corners, plane(*corners.T) + lift])

    vertices = np.concatenate([sheet(0, 2, 0, 1, 0.0), sheet(0.5, 1.0, 0.25, 0.5, 0.4)])
    faces = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 7, 6)])  # one is wound the other way
    wall = np.array([(0.0, 0.0, 9.0)])
    vertices, faces = np.concatenate([vertices, wall]), np.concatenate([faces, [(0, 0, 8)]])
    low, high = np.array([0.0, 0.0]), np.array([2.0, 1.0])
    found = ElevationMap.of_triangles(vertices, faces, low, high, 0.125)
    x, y = np.meshgrid(np.arange(17) * 0.125, np.arange(9) * 0.125)
    above = (x >= 0.5) & (x <= 1.0) & (y >= 0.25) & (y <= 0.5)
    np.testing.assert_allclose(found.z_m, plane(x, y) + 0.4 * above)
    half = ElevationMap.of_triangles(vertices[:4], faces[:1], low, high, 0.125)
    np.testing.assert_array_equal(half.known, y <= 0.5 * x + 1e-9)


def test_a_raster_of_flat_cells_is_sampled_on_its_plane_and_keeps_its_hole() -> None:
    x, y = np.meshgrid(np.arange(20) * 0.4, np.arange(30) * 0.3)
    z = plane(x, y)
    z[10:14, 5:9] = np.nan
    found = ElevationMap.of_raster(z, 0.4, 0.3, 0.1)
    at = np.meshgrid(np.arange(found.z_m.shape[1]) * 0.1, np.arange(found.z_m.shape[0]) * 0.1)
    known = found.known
    np.testing.assert_allclose(found.z_m[known], plane(*at)[known], atol=5e-3)
    x, y = at  # the hole reaches from known sample to known sample
    in_hole = (x > 1.6 + 1e-6) & (x < 3.6 - 1e-6) & (y > 2.7 + 1e-6) & (y < 4.2 - 1e-6)
    np.testing.assert_array_equal(known, ~in_hole)
    coarse = ElevationMap.of_raster(z, 0.4, 0.3, 1.0)
    assert coarse.spacing_m == 1.0
    assert coarse.z_m.shape == (10, 9)


def test_holes_are_known_as_holes_and_only_narrow_ones_are_filled() -> None:
    z = np.zeros((40, 40))
    z[10, 10] = z[5:7, 20:35] = np.nan  # one sample; two samples wide
    z[20:30, 20:30] = np.nan
    z[:, 0] = np.nan
    held = ElevationMap(z, 0.1, 0.0, 0.0)
    strict = held.height_field()
    np.testing.assert_array_equal(strict.known, np.isfinite(z))
    assert np.isfinite(strict.z_m).all()
    some = held.height_field(0.4).known
    assert some[10, 10]
    assert some[5:7, 20:35].all()
    assert not some[21:29, 21:29].any()
    assert not some[:, 0].any()  # beyond the border nothing is known


def test_what_is_too_large_too_small_or_empty_is_refused() -> None:
    points = np.array([(0.0, 0.0, 0.0), (5000.0, 5000.0, 0.0)])
    with pytest.raises(InputError, match=r"are over 4000000; use a spacing of 2\.5 m or more"):
        ElevationMap.of_points(points, 1.0)
    with pytest.raises(InputError, match="fewer than 2 by 2"):
        ElevationMap.of_points(points, 1e5)
    with pytest.raises(InputError, match="no point"):
        ElevationMap.of_points(points[:0], 1.0)
    with pytest.raises(InputError, match="no cell holds a height"):
        ElevationMap(np.full((3, 3), np.nan), 1.0, 0.0, 0.0).height_field()
    with pytest.raises(InputError, match="no cell holds a height"):
        ElevationMap.of_raster(np.full((3, 3), np.nan), 1.0, 1.0, 0.5)
