"""Curves from ellipses and from meshes of known shape."""

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.mesh.body_model import spindle
from snakewalk.controller.animals.mesh.cross_sections import AROUND, cut, ellipses

Floats = NDArray[np.float64]


def ellipsoid() -> trimesh.Trimesh:
    """Half axes 1, 0.2 and 0.3; its head at x = 0."""
    solid = trimesh.creation.icosphere(subdivisions=5)
    solid.apply_scale([1.0, 0.2, 0.3])
    solid.apply_translation([-1.0, 0.0, 0.0])
    return solid


def test_an_ellipsoid_is_cut_into_its_ellipses() -> None:
    found = cut(ellipsoid(), 21)
    assert found.length_m == pytest.approx(2.0, abs=1e-6)
    assert found.axis_m == pytest.approx(0.0, abs=1e-6)
    x, y, z = found.curves_m[1:-1].transpose(2, 0, 1)
    np.testing.assert_allclose((x + 1.0) ** 2 + (y / 0.2) ** 2 + (z / 0.3) ** 2, 1.0, atol=5e-3)
    assert (y[:, 0] > 0).all()
    assert (z[:, AROUND // 4] > 0).all()
    np.testing.assert_allclose(y[:, 0], -y[:, AROUND // 2], atol=2e-3)


@pytest.mark.slow
def test_fins_and_a_forked_tail_are_no_part_of_the_tube() -> None:
    """A detached fin is larger than the body where it stands; the lobes begin behind the tail."""
    body = ellipsoid()
    back = trimesh.creation.box([0.2, 0.01, 0.9])
    back.apply_translation([-1.7, 0.0, 0.75])
    lobes = [trimesh.creation.box([0.4, 0.01, 0.1]) for _ in range(2)]
    for lobe, z in zip(lobes, (0.2, -0.2), strict=True):
        lobe.apply_translation([-2.1, 0.0, z])
    found = cut(trimesh.util.concatenate([body, back, *lobes]), 21)
    assert found.length_m == pytest.approx(2.3, abs=1e-6)
    assert found.stations[-1] * 2.3 == pytest.approx(2.0, abs=0.03)
    assert np.abs(found.curves_m[..., 2]).max() < 0.301


def test_a_mesh_without_a_closed_loop_is_refused() -> None:
    flat = trimesh.Trimesh([[0, 0, 0], [-1, 0, 0], [-1, 1, 0.1]], [[0, 1, 2]])
    with pytest.raises(InputError, match="closed"):
        cut(flat)
    with pytest.raises(InputError, match="4 or more"):
        cut(ellipsoid(), 3)


def test_ellipses_lie_on_the_ground_and_close_at_the_tips() -> None:
    found = ellipses(spindle(2.0), curves=25)
    assert found.curves_m.shape == (25, AROUND, 3)
    low = found.curves_m[..., 2].min(axis=1)
    np.testing.assert_allclose(low, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.ptp(found.curves_m[[0, -1]], axis=1), 0.0, atol=1e-12)
    assert found.axis_m == pytest.approx(2.0 * spindle().half_height.max())
    with pytest.raises(InputError, match="12 or more"):
        ellipses(spindle(), curves=11)
