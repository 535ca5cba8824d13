"""Triangles of a place: they cover the cells that are shown, no others."""

import numpy as np

from snakewalk.controller.mapping.mosaic.place_mesh import BLOCK_PX, triangles_over


def test_triangles_cover_the_shown_cells_and_whole_blocks_get_two() -> None:
    rng = np.random.default_rng(0)
    shown = np.ones((22, 31), bool)
    shown[5, 9] = shown[21, 30] = False
    shown[12:, :4] = rng.random((10, 4)) < 0.5
    corners = np.stack(np.divmod(triangles_over(shown), 32), axis=-1)
    assert corners.max(axis=(0, 1)).tolist() == [22, 31]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    assert area.min() > 0.0  # all face the camera
    assert area.sum() == shown.sum()
    covered = np.zeros_like(shown)
    low = corners.min(axis=1)
    for (row, column), side in zip(low, np.ptp(corners[..., 0], axis=1), strict=True):
        covered[row : row + side, column : column + side] = True
    assert np.array_equal(covered, shown)
    assert (area == 0.5 * BLOCK_PX**2).sum() == 2 * (5 * 7 - 1 - 2)
