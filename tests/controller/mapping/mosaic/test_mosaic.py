"""A mosaic of views that differ by a rotation, and Eq. 7."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.errors import InputError
from snakewalk.controller.mapping.mosaic.local_model import LocalModel
from snakewalk.controller.mapping.mosaic.mosaic import mosaic
from tests.oracles.ravine import Camera, station

CAMERA = Camera((160, 120), 110.0)
ANGLES_RAD = (0.0, 0.5, -0.5)


@pytest.fixture(scope="module")
def views() -> list[LocalModel]:
    """Three views from one place, with exact depths; each one's depths are off by a factor."""
    made = []
    for angle, factor in zip(ANGLES_RAD, (1.0, 1.06, 0.95), strict=True):
        picture, depth = CAMERA.look(station(1.0, angle, 0.0), fine=1)
        v, u = np.mgrid[:120, :160]
        k = CAMERA.matrix
        flat = np.stack([(u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1], np.ones(u.shape)], -1)
        made.append(LocalModel(flat * depth[..., None] * factor, picture, k, 0.1))
    return made


def seam(depth: np.ndarray, edge: np.ndarray) -> float:
    """Median relative step of depth between the first view and the next column outside of it."""
    rows, columns = np.nonzero(edge[:, :-1] & ~edge[:, 1:] & np.isfinite(depth[:, 1:]))
    return float(np.median(np.abs(depth[rows, columns + 1] / depth[rows, columns] - 1.0)))


@pytest.mark.costs("joins whole images")
def test_the_views_meet_without_a_step(views: list[LocalModel]) -> None:
    plain, joined = mosaic(views, rectified=False), mosaic(views)
    for found, angle in zip(joined.rotations, ANGLES_RAD, strict=True):
        turn = station(1.0, 0.0, 0.0).axes.T @ station(1.0, angle, 0.0).axes
        assert Rotation.from_matrix(found.T @ turn).magnitude() < 0.006
    assert joined.model.valid.sum() > 1.7 * views[0].valid.sum()
    np.testing.assert_array_equal(
        joined.model.points_m[joined.domain[0]], joined.views[0].points_m[joined.domain[0]]
    )
    edge = joined.domain[0]
    assert seam(plain.model.points_m[..., 2], edge) > 0.04
    assert seam(joined.model.points_m[..., 2], edge) < 0.015


def test_a_view_of_another_place_is_refused(views: list[LocalModel]) -> None:
    other = LocalModel(views[1].points_m, views[1].image[::-1, ::-1].copy(), views[1].camera, 0.1)
    with pytest.raises(InputError, match="view 2 does not overlap"):
        mosaic([views[0], other])
