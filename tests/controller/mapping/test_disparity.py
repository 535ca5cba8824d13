"""Disparities of pairs whose true ones are known in closed form: planes, a step, nothing to see."""

import cv2
import numpy as np
import pytest
import skimage.data
from scipy.ndimage import gaussian_filter, map_coordinates

from benchmarks.stereo import widened_opencv
from snakewalk.config.errors import InputError
from snakewalk.controller.mapping.disparity import _filled_gaps, match

ROWS, COLUMNS = 120, 200
V, U = np.mgrid[:ROWS, :COLUMNS].astype(float)


def grain(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z = sum(gaussian_filter(rng.normal(size=(ROWS, 2 * COLUMNS)), s) * s for s in (0.8, 2.0, 5.0))
    return 120 + 45 * z / z.std()


def painted(picture: np.ndarray, column: np.ndarray, noise: float = 2.0) -> np.ndarray:
    """What a camera sees that looks at these columns of a grain."""
    seen = map_coordinates(picture, [V, column + 0.5 * COLUMNS], order=3, mode="nearest")
    seen = seen + np.random.default_rng(1).normal(0.0, noise, seen.shape)
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.0, 0.15), (0.08, 0.1)], ids=str)
def test_a_plane_is_found_to_a_tenth_of_a_pixel(slope) -> None:
    a, b = slope
    picture, c = grain(2), 8.3
    left = painted(picture, U)
    # disparity a u + b v + c at the left column u, which the right picture has at u - disparity
    right = painted(picture, (U + b * V + c) / (1.0 - a))
    found = match(left, right, 48)
    truth = a * U + b * V + c
    told = np.isfinite(found)
    inside = (U - truth > 4) & (U < COLUMNS - 4)
    assert told[inside].mean() > 0.95
    assert told[U - truth < -1.0].mean() < 0.1  # what the right picture does not show
    error = np.abs(found - truth)[told & inside]
    assert np.median(error) < 0.05
    assert np.quantile(error, 0.99) < 0.3


def test_a_step_keeps_its_edge_and_what_one_camera_alone_sees_is_not_told() -> None:
    near, far = 20.0, 6.0
    front, back = grain(3), grain(4)
    block = slice(80, 140)  # columns of the left picture that the near block covers
    left = painted(back, U)
    left[:, block] = painted(front, U)[:, block]
    right = painted(back, U + far)
    shifted = slice(block.start - int(near), block.stop - int(near))
    right[:, shifted] = painted(front, U + near)[:, shifted]
    found = match(left, right, 32)
    truth = np.where((block.start <= U) & (block.stop > U), near, far)
    hidden = (block.start - (near - far) <= U) & (block.start > U)
    told = np.isfinite(found)
    assert told[~hidden & (far < U)].mean() > 0.93
    assert told[hidden].mean() < 0.35
    wrong = (np.abs(found - truth) > 1.0) & told
    assert wrong[~hidden].mean() < 0.01


def test_where_there_is_nothing_to_see_little_is_told_and_wrong_pairs_are_refused() -> None:
    rng = np.random.default_rng(5)
    one, two = (rng.integers(0, 255, (ROWS, COLUMNS), dtype=np.uint8) for _ in range(2))
    assert np.isfinite(match(one, two, 64)).mean() < 0.02
    with pytest.raises(InputError, match="the pictures are"):
        match(one, two[:-1], 64)
    with pytest.raises(InputError, match="208 disparities from 0 on"):
        match(one, two, 200)


def test_on_a_real_pair_more_is_right_than_by_opencv_and_less_of_what_is_told_is_wrong() -> None:
    """A strip of Middlebury's motorcycle, as scikit-image packs it."""
    left, right, truth = (picture[200:320] for picture in skimage.data.stereo_motorcycle())
    matcher = cv2.StereoSGBM.create(0, 80, 5, 8 * 75, 32 * 75, 1, 0, 10, 100, 2)
    plain = matcher.compute(left, right).astype(float) / 16.0
    known = np.isfinite(truth)
    shares = []
    for found in (match(left, right, 80), np.where(plain > 0.0, plain, np.nan)):
        told = known & np.isfinite(found)
        right_ones = np.abs(found - truth)[told] < 1.0
        shares.append((right_ones.sum() / known.sum(), right_ones.mean()))
    assert shares[0][0] > shares[1][0] + 0.02
    assert shares[0][1] > shares[1][1] + 0.01


def test_little_is_told_of_a_sky_over_textured_ground() -> None:
    """The matches of an edge go on in a plain sky (in half of it) unless they must stand out."""
    left, right = painted(grain(2), U), painted(grain(2), U + 12.0)
    rng = np.random.default_rng(9)
    for picture in (left, right):
        picture[:50] = np.rint(170 + rng.normal(0.0, 3.0, (50, COLUMNS)))
    told = np.isfinite(match(left, right, 32))
    assert told[:46].mean() < 0.25
    assert told[54:, 16:-4].mean() > 0.95


def test_filled_gaps_are_interpolated_or_belong_to_the_farther_side() -> None:
    nan = np.nan
    row = np.array([[nan, 4.0, nan, nan, 4.6, nan, 9.0, nan, nan, nan, 9.0, nan]])
    found = _filled_gaps(row, 2)
    wanted = [nan, 4.0, 4.2, 4.4, 4.6, 4.6, 9.0, nan, nan, nan, 9.0, nan]
    assert np.allclose(found[0], wanted, equal_nan=True)
    assert np.array_equal(_filled_gaps(row, 0), row, equal_nan=True)


@pytest.mark.costs("matches a whole pair of images")
def test_filled_gaps_lead_a_real_pair_in_both_columns() -> None:
    left, right, truth = skimage.data.stereo_motorcycle()
    has_truth = np.isfinite(truth)
    shares = []
    for found in (match(left, right, 80, fill_px=16), widened_opencv(left, right, 80)):
        told = has_truth & np.isfinite(found)
        close = np.abs(found - truth)[told] <= 1.0
        shares.append((close.sum() / has_truth.sum(), close.mean()))
    assert shares[0][0] > shares[1][0] + 0.005
    assert shares[0][1] > shares[1][1] + 0.01
