"""Eq. 5 to 7: gradients are kept, given values are met."""

import numpy as np

from snakewalk.controller.mapping.mosaic.poisson import continued


def grid(rows: int = 12, columns: int = 15) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(2)
    shape = rng.normal(size=(rows, columns, 3))
    given = np.zeros((rows, columns), bool)
    given[:, :4] = True
    return shape, given


def test_a_model_that_is_only_moved_stays_as_it_is() -> None:
    shape, given = grid()
    moved = np.array([0.3, -2.0, 5.0])
    values = np.where(given[..., None], shape + moved, np.nan)
    np.testing.assert_allclose(continued(values, given, shape), shape + moved, atol=1e-9)


def test_values_at_the_edge_of_the_picture_would_bend_a_model_that_is_only_moved() -> None:
    """Eq. 5 gives Z on the whole border, and the outer part of it has no other model to be met."""
    shape, given = grid()
    moved = np.where(given[..., None], shape + 1.0, shape)
    edge = np.ones_like(given)
    edge[1:-1, 1:-1] = False
    free = continued(moved, given, shape) - shape
    printed = continued(moved, given | edge, shape) - shape
    np.testing.assert_allclose(free, 1.0, atol=1e-9)
    assert np.ptp(printed[1:-1, 4:-1]) > 0.5


def test_eq_6_holds_at_each_unknown_pixel_and_no_other_map_has_less_of_eq_5() -> None:
    shape, given = grid()
    rng = np.random.default_rng(4)
    values = np.where(given[..., None], rng.normal(size=shape.shape), np.nan)
    found = continued(values, given, shape)
    np.testing.assert_array_equal(found[given], values[given])
    inner = (slice(1, -1), slice(5, -1))

    def laplace(z: np.ndarray) -> np.ndarray:
        return (z[:-2, 1:-1] + z[2:, 1:-1] + z[1:-1, :-2] + z[1:-1, 2:] - 4 * z[1:-1, 1:-1])[
            :, inner[1].start - 1 :
        ]

    np.testing.assert_allclose(laplace(found), laplace(shape), atol=1e-9)

    def integral(z: np.ndarray) -> float:
        off = z - shape
        unknown = ~given
        total = 0.0
        for axis in (0, 1):
            square = (np.diff(off, axis=axis) ** 2).sum(axis=-1)
            low, high = (
                np.moveaxis(unknown, axis, 0)[part] for part in (slice(None, -1), slice(1, None))
            )
            total += float(np.moveaxis(square, axis, 0)[low | high].sum())
        return total

    least = integral(found)
    for _ in range(20):
        other = found + 0.01 * rng.normal(size=found.shape) * ~given[..., None]
        assert integral(other) > least


def test_without_the_fill_the_map_jumps_and_with_it_there_is_no_jump() -> None:
    """Fig. 5: the largest step across the boundary, of models that differ by half a metre."""
    shape = np.broadcast_to(np.linspace(1.0, 2.0, 40)[None, :, None], (10, 40, 3)).copy()
    given = np.zeros((10, 40), bool)
    given[:, :20] = True
    values = np.where(given[..., None], shape + 0.5, np.nan)
    plain = np.where(given[..., None], values, shape)
    assert np.abs(np.diff(plain - shape, axis=1)).max() > 0.49
    filled = continued(values, given, shape)
    assert np.abs(np.diff(filled - shape, axis=1)).max() < 1e-9


def test_holes_stay_holes_and_a_part_without_given_values_keeps_its_shape() -> None:
    shape, given = grid()
    shape[:, 8] = np.nan
    values = np.where(given[..., None], shape + 1.0, np.nan)
    found = continued(values, given, shape)
    assert np.isnan(found[:, 8]).all()
    np.testing.assert_allclose(found[:, 4:8], shape[:, 4:8] + 1.0, atol=1e-9)
    np.testing.assert_array_equal(found[:, 9:], shape[:, 9:])
