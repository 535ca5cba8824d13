"""A map that grows: heights are joined by their errors, and what was not seen stays unknown."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.heightfield import HeightField, read_map
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.growing_map import GrowingMap
from snakewalk.controller.terrain.relief import Relief


def empty() -> GrowingMap:
    return GrowingMap(-1.0, -1.0, (2.0, 2.0), 0.05)


def patch(x: float, y: float, z: float, half: float = 0.2) -> np.ndarray:
    """Points 1 cm apart on a level square."""
    side = np.arange(-half, half + 1e-9, 0.01)
    across, along = np.meshgrid(x + side, y + side)
    return np.stack([across, along, np.full_like(across, z)], axis=-1).reshape(-1, 3)


def at(grown: GrowingMap, x: float, y: float) -> tuple[int, int]:
    return round((y - grown.y0_m) / grown.spacing_m), round((x - grown.x0_m) / grown.spacing_m)


def seen(grown: GrowingMap, points: np.ndarray, error_m: float, time_s: float = 0.0) -> None:
    grown.add(points, np.full(len(points), error_m), time_s)


def test_two_looks_are_weighed_by_their_errors() -> None:
    grown = empty()
    seen(grown, patch(0.0, 0.0, 0.10), 0.02, 1.0)
    seen(grown, patch(0.0, 0.0, 0.13), 0.01, 2.0)
    here = at(grown, 0.0, 0.0)
    assert grown.z_m[here] == pytest.approx((0.10 / 4 + 0.13) / (1 / 4 + 1))
    assert grown.error_m[here] == pytest.approx((0.02**-2 + 0.01**-2) ** -0.5)
    assert grown.first_s[here] == 1.0
    assert grown.pictures == 2


@pytest.mark.parametrize(("second_error", "height"), [(0.004, 0.5), (0.03, 0.1)])
def test_of_two_looks_that_contradict_each_other_the_nearer_counts(
    second_error: float, height: float
) -> None:
    grown = empty()
    seen(grown, patch(0.0, 0.0, 0.1), 0.01)
    seen(grown, patch(0.0, 0.0, 0.5), second_error)
    assert grown.z_m[at(grown, 0.0, 0.0)] == pytest.approx(height)


def test_a_single_point_and_what_lies_outside_are_left_out() -> None:
    grown = empty()
    seen(grown, np.array([[0.0, 0.0, 0.1], [5.0, 0.0, 0.1], [5.0, 0.0, 0.1]]), 0.01)
    assert not grown.known.any()
    assert grown.height_field() is None


def test_only_what_was_seen_is_known_and_the_rest_goes_on_from_it() -> None:
    grown = empty()
    seen(grown, patch(0.0, 0.0, 0.1, 0.4), 0.01)
    grown.touch(np.array([[-0.9, -0.9, 0.3]]))
    field = grown.height_field()
    assert field is not None
    assert field.known is not None
    assert field.known.mean() == pytest.approx((0.8 / 2.0) ** 2, abs=0.03)
    assert field.elevation_m(0.9, 0.0) == pytest.approx(0.1, abs=0.01)
    assert field.elevation_m(-0.9, -0.9) == pytest.approx(0.3, abs=0.02)  # the body lies there
    assert not field.known[at(grown, -0.9, -0.9)]
    relief = Relief(field, PlannerConfig(edge_margin_m=0.0))
    side = np.linspace(-1.0, 1.0, 41)
    safe = relief.safe(*np.meshgrid(side, side))
    assert safe.any()
    assert not (safe & ~field.known).any()


def test_a_hole_narrower_than_the_body_counts_as_known_a_wide_one_does_not() -> None:
    for half, known in ((0.03, True), (0.2, False)):
        grown = empty()
        points = patch(0.0, 0.0, 0.1, 0.6)
        hole = np.abs(points[:, :2]).max(axis=1) < half
        seen(grown, points[~hole], 0.01)
        field = grown.height_field()
        assert field is not None
        assert field.known is not None
        assert field.known[at(grown, 0.0, 0.0)] == known


def test_it_begins_empty_again_and_is_a_map_that_a_world_takes(tmp_path: Path) -> None:
    flat = HeightField(np.zeros((41, 41)), 0.05, -1.0, -1.0)
    grown = GrowingMap.over(flat, 0.05)
    seen(grown, patch(0.0, 0.0, 0.1), 0.01, 3.0)
    file = tmp_path / "map.npz"
    grown.write(file)
    back = read_map(file)
    assert back.known is not None
    np.testing.assert_array_equal(back.known, grown.known)
    assert back.z_m[grown.known] == pytest.approx(0.1)
    grown.clear()
    assert grown.pictures == 0
    assert not grown.known.any()
