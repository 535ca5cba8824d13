"""The picture of a thin body: its light and its slopes, against closed forms and differences."""

import numpy as np
import pytest

from snakewalk.controller.images import thin_body_fit
from snakewalk.controller.images.thin_body_fit import fitted

SHAPE = (40, 56)


def values() -> np.ndarray:
    """Controls of a bend within the picture, five weights and the width of a spot."""
    x = np.linspace(14.0, 42.0, 9)
    return np.concatenate([x, 20.0 + 5.0 * np.sin(x / 6.0), [2.0, 3.0, 3.0, 2.5, 1.0], [1.8]])


def test_all_light_of_the_spots_is_in_the_picture() -> None:
    shown, _ = thin_body_fit._picture(values(), SHAPE)
    weights = thin_body_fit._HATS @ values()[-6:-1]
    assert shown.sum() == pytest.approx(weights.sum(), rel=1e-6)


@pytest.mark.parametrize("which", range(0, 24, 3))
def test_slopes_are_those_of_the_picture(which: int) -> None:
    at, step = values(), 1e-5
    slopes = thin_body_fit._picture(at, SHAPE)[1][:, which].reshape(SHAPE)
    before, after = at.copy(), at.copy()
    before[which] -= step
    after[which] += step
    ends = [thin_body_fit._picture(each, SHAPE)[0] for each in (before, after)]
    assert slopes == pytest.approx((ends[1] - ends[0]) / (2.0 * step), abs=1e-7)


def test_the_curve_of_a_picture_of_spots_is_found_again() -> None:
    shown, _ = thin_body_fit._picture(values(), SHAPE)
    true = np.stack([thin_body_fit._FINE_BASIS @ v for v in np.split(values()[:18], 2)], axis=1)
    guess = true[::8] + np.array([0.6, -0.8])
    found = fitted(guess, shown.astype(np.float32), 4.0)
    assert found is not None
    curve, left = found
    assert left < 0.01
    away = np.hypot(*(curve[1:-1, None] - true[None]).transpose(2, 0, 1)).min(axis=1)
    assert away.max() < 0.1


def test_loops_draw_the_same_as_python() -> None:
    rng = np.random.default_rng(0)
    places = rng.uniform(-3.0, 15.0, (2, 5))
    slopes = rng.normal(size=(3, 4, 5))
    compiled, python = (
        (np.zeros((14, 18)), np.zeros((5, 14, 18)), draw)
        for draw in (thin_body_fit.draw_spots, thin_body_fit.draw_spots.py_func)
    )
    for cover, by, draw in (compiled, python):
        draw(*places, np.linspace(0.5, 2.0, 5), *slopes, 1.7, cover, by)
    np.testing.assert_allclose(compiled[0], python[0], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(compiled[1], python[1], rtol=1e-12, atol=1e-14)
    assert python[0].max() > 0.01


def test_spots_beyond_each_edge_draw_the_part_that_is_inside() -> None:
    """Each picture is the cut of that of the same spots in a larger one."""
    rng = np.random.default_rng(1)
    area, slopes = np.linspace(0.5, 2.0, 6), rng.normal(size=(3, 4, 6))
    places = np.array([[-2.0, 15.0, 4.0, 9.0, -3.0, 16.0], [5.0, 4.0, -2.0, 12.0, -2.0, 12.5]])
    cuts = []
    for margin in (0, 20):
        shape = 11 + 2 * margin, 14 + 2 * margin
        cover, by = np.zeros(shape), np.zeros((5, *shape))
        thin_body_fit.draw_spots.py_func(*(places + margin), area, *slopes, 1.7, cover, by)
        inside = slice(margin, shape[0] - margin), slice(margin, shape[1] - margin)
        cuts.append((cover[inside], by[:, *inside]))
    np.testing.assert_allclose(cuts[0][0], cuts[1][0], atol=1e-15)
    np.testing.assert_allclose(cuts[0][1], cuts[1][1], atol=1e-14)
    assert cuts[0][0].max() > 0.01


@pytest.mark.parametrize("reach", [0.5, 2.2])
def test_a_fit_that_leaves_its_guess_is_none(reach: float) -> None:
    """A guess half as long as the body, or more than twice as long, is of something else."""
    shown, _ = thin_body_fit._picture(values(), SHAPE)
    true = np.stack([thin_body_fit._FINE_BASIS @ v for v in np.split(values()[:18], 2)], axis=1)
    middle = true.mean(axis=0)
    assert fitted(middle + reach * (true[::8] - middle), shown.astype(np.float32), 4.0) is None
