"""A bar of known place and contrast is cut out of a plate; all expected numbers are by hand."""

import numpy as np
import pytest

from snakewalk.controller.images.silhouette import (
    Polarity,
    as_deep_as,
    body_threshold,
    connected_parts,
    contrast,
    cut_out,
    noise_of,
    silhouette_of,
)
from snakewalk.controller.track.frame_status import FrameStatus

ROWS, COLUMNS = 60, 90
GROUND = 200


def plate(*bars: tuple[int, int, int, int, int]) -> np.ndarray:
    """Ground with bars (top, left, rows, columns, grey value)."""
    image = np.full((ROWS, COLUMNS), GROUND, dtype=np.uint8)
    for top, left, rows, columns, grey in bars:
        image[top : top + rows, left : left + columns] = grey
    return image


def threshold_in(levels: np.ndarray) -> float | None:
    return body_threshold(levels, *noise_of(levels))


def apart(*bars: tuple[int, int, int, int, int]) -> np.ndarray:
    """Contrast of bars (top, left, rows, columns, contrast) on nothing."""
    return GROUND - plate(*((*place, GROUND - level) for *place, level in bars))


EMPTY = plate()
BAR = (20, 30, 10, 30, 100)


def test_contrast_has_the_direction_of_the_polarity() -> None:
    image = np.array([[190, 200, 215]], dtype=np.uint8)
    ground = np.full_like(image, GROUND)
    for polarity, expected in (
        (Polarity.DARK, [10, 0, 0]),
        (Polarity.LIGHT, [0, 0, 15]),
        (Polarity.BOTH, [10, 0, 15]),
    ):
        assert contrast(image, ground, polarity).tolist() == [expected]
        deep = contrast(image.astype(np.float32), ground.astype(np.float32), polarity)
        assert deep.tolist() == [expected]


def test_the_strongest_channel_of_a_colour_counts() -> None:
    ground = np.full((1, 3, 3), GROUND, dtype=np.uint8)
    image = ground.copy()
    for channel in range(3):
        image[0, channel, channel] -= 10 * (channel + 1)
    assert contrast(image, ground, Polarity.DARK).tolist() == [[10, 20, 30]]


def test_values_for_an_image_of_8_bit_are_rounded() -> None:
    values = np.array([1.4, 1.6])
    assert as_deep_as(EMPTY, values).tolist() == [1, 2]
    assert as_deep_as(EMPTY, values).dtype == np.uint8
    deep = as_deep_as(EMPTY.astype(np.float32), values)
    np.testing.assert_allclose(deep, values, rtol=1e-6)
    assert deep.dtype == np.float32


def test_noise_is_the_median_and_the_usual_excess_over_it() -> None:
    """Of 0 to 8 the median is 4; the values from there lie 0 to 4 above, so 2 in the middle."""
    middle, spread = noise_of(np.arange(9, dtype=np.float32).reshape(3, 3))
    assert middle == 4.0
    assert spread == pytest.approx(1.4826 * 2.0 + 0.5)


def test_of_a_large_picture_every_second_pixel_tells_the_noise() -> None:
    picture = np.zeros((400, 402), dtype=np.float32)
    picture[1::2] = picture[:, 1::2] = 50.0  # three quarters of the pixels
    assert noise_of(picture) == (0.0, 0.5)
    assert noise_of(picture[:398])[0] == 50.0


def test_a_bar_is_found_with_its_place_area_and_half_of_its_contrast() -> None:
    seen = silhouette_of(plate(BAR), EMPTY, Polarity.DARK)
    assert seen.status is FrameStatus.GOOD
    assert seen.origin_px == (26.0, 16.0)  # four pixels of margin
    assert seen.level.shape == (18, 38)
    assert seen.threshold == pytest.approx(50.0, abs=1.0)
    assert seen.noise_level == pytest.approx(6.0 * 0.5)
    assert seen.distractors == 0.0
    assert seen.area_px == 10 * 30  # the blur leaves 75 at an edge and 56 in a corner
    mask = np.zeros((18, 38), dtype=bool)
    mask[4:14, 4:34] = True
    np.testing.assert_array_equal(seen.mask, mask)


def test_a_light_bar_is_nothing_to_a_detector_of_dark_ones() -> None:
    light = plate((20, 30, 10, 30, 240))
    assert silhouette_of(light, EMPTY, Polarity.DARK).status is FrameStatus.NOTHING
    assert silhouette_of(light, EMPTY, Polarity.LIGHT).status is FrameStatus.GOOD
    assert silhouette_of(light, EMPTY).status is FrameStatus.GOOD


def test_no_body_has_no_threshold() -> None:
    assert silhouette_of(EMPTY, EMPTY).status is FrameStatus.NOTHING
    nothing = silhouette_of(EMPTY, EMPTY)
    assert (nothing.area_px, nothing.noise_level, nothing.origin_px) == (0.0, 0.0, (0.0, 0.0))
    assert not nothing.mask.any()
    assert threshold_in(apart()) is None


def test_a_given_threshold_is_the_boundary() -> None:
    seen = silhouette_of(plate(BAR), EMPTY, threshold=80.0)
    assert seen.threshold == 80.0
    assert seen.area_px == 8 * 28  # edges are at 75 after the blur
    assert seen.noise_level == pytest.approx(3.0)
    assert silhouette_of(plate(BAR), EMPTY, threshold=2.0).noise_level == 2.0
    assert silhouette_of(plate(BAR), EMPTY, threshold=101.0).status is FrameStatus.NOTHING


@pytest.mark.parametrize(
    ("top", "left", "is_cut"),
    [
        (0, 30, True),
        (1, 30, False),
        (ROWS - 10, 30, True),
        (ROWS - 11, 30, False),
        (20, 0, True),
        (20, 1, False),
        (20, COLUMNS - 30, True),
        (20, COLUMNS - 31, False),
    ],
)
def test_a_body_at_the_edge_of_the_picture_is_cut(top: int, left: int, is_cut: bool) -> None:
    seen = cut_out(apart((top, left, 10, 30, 100)), 50.0, 3.0, 0.0, 4)
    assert seen.status is (FrameStatus.CUT if is_cut else FrameStatus.GOOD)
    assert seen.area_px == 300.0
    assert seen.origin_px == (max(0, left - 4), max(0, top - 4))
    rows = min(ROWS, top + 14) - max(0, top - 4)
    assert seen.level.shape == (rows, min(COLUMNS, left + 34) - max(0, left - 4))


@pytest.mark.parametrize(("columns", "status"), [(12, FrameStatus.GOOD), (13, FrameStatus.SEVERAL)])
def test_a_second_object_of_over_two_fifths_of_the_area_is_a_rival(
    columns: int, status: FrameStatus
) -> None:
    other = (45, 5, 10, columns, 90)
    seen = cut_out(apart(BAR, other), 50.0, 3.0, 0.0, 4)
    assert seen.status is status
    assert seen.distractors == pytest.approx(columns / 30.0)
    assert seen.area_px == 300.0


def test_the_body_has_the_largest_contrast_in_sum_above_the_background() -> None:
    """The small bar is stronger: 100 * (180 - 40) over 300 * (80 - 40)."""
    strong, wide = (45, 5, 10, 10, 180), (*BAR[:4], 80)
    assert cut_out(apart(strong, wide), 50.0, 3.0, 40.0, 4).area_px == 100.0
    assert cut_out(apart(strong, wide), 50.0, 3.0, 0.0, 4).area_px == 300.0


def test_other_things_in_the_cut_out_are_erased_with_their_blurred_edge() -> None:
    """A speck three pixels from the bar: it and one pixel around it become 0."""
    picture = apart(BAR, (33, 40, 3, 3, 90)) + np.uint8(10)
    seen = cut_out(picture, 60.0, 255.0, 0.0, 4)
    assert seen.level.shape == (18, 38)
    near = seen.level[16:, 13:18]  # rows 32 and 33, columns 39 to 43
    np.testing.assert_array_equal(near, 0.0)
    assert seen.level[16, 12] == seen.level[16, 18] == seen.level[15, 15] == 10.0
    assert seen.level[10, 20] == 110.0


def test_the_margin_grows_only_if_the_body_fades_out_at_its_edge() -> None:
    faded = apart((12, 22, 26, 46, 20), BAR)
    for noise_level, most_px, margin in ((3.0, 20, 20), (20.0, 20, 4), (3.0, 4, 4)):
        seen = cut_out(faded, 50.0, noise_level, 0.0, most_px)
        assert seen.origin_px == (30.0 - margin, 20.0 - margin)
    wide = silhouette_of(plate((12, 22, 26, 46, 180), BAR), EMPTY, wide_margin=True)
    assert wide.origin_px == (10.0, 0.0)


@pytest.mark.parametrize(("pixels", "is_found"), [(11, False), (12, True)])
def test_parts_below_twelve_pixels_are_noise(pixels: int, is_found: bool) -> None:
    mask = np.zeros((ROWS, COLUMNS), dtype=np.uint8)
    mask[3, 5 : 5 + pixels] = 1
    found = connected_parts(mask)
    assert (found is not None) == is_found
    mask[50, 80] = 1  # the box around both is large
    found = connected_parts(mask)
    assert (found is not None) == is_found
    if found is not None:
        label, stats = found
        assert np.count_nonzero(label == 1) == 12
        assert label.shape == mask.shape
        assert stats[1].tolist() == [5, 3, 12, 1, 12]
        assert stats[2].tolist() == [80, 50, 1, 1, 1]


def test_more_parts_than_two_bytes_can_number_are_kept_apart() -> None:
    mask = np.zeros((600, 600), dtype=np.uint8)
    mask[::2, ::2] = 1
    mask[300:310, 300:310] = 1
    found = connected_parts(mask)
    assert found is not None
    label, stats = found
    assert len(np.unique(label)) == len(stats) > 2**16


def test_pixels_that_touch_at_a_corner_are_one_part() -> None:
    mask = np.eye(14, dtype=np.uint8)
    found = connected_parts(mask)
    assert found is not None
    assert found[1][1].tolist() == [0, 0, 14, 14, 14]


def test_the_threshold_is_half_of_an_even_body() -> None:
    assert threshold_in(apart(BAR)) == pytest.approx(50.0)
    uneven = apart(BAR, (20, 30, 10, 20, 80))  # two thirds of it at 80: the 70th percentile is 100
    assert threshold_in(uneven) == pytest.approx(50.0)


def test_a_faint_shade_joined_to_the_body_does_not_lower_the_threshold() -> None:
    """The shade has four times the pixels: its percentile is 20, the body's contrast stays 100."""
    shade = (12, 22, 30, 50, 20)
    assert threshold_in(apart(shade, BAR)) == pytest.approx(50.0)


def test_the_part_with_most_summed_contrast_sets_the_threshold() -> None:
    """16 * 200 against 300 * 60, though the squares are nearer: 0.64 to 1.08 million."""
    speck, body = (45, 5, 4, 4, 200), (*BAR[:4], 60)
    assert threshold_in(apart(speck, body)) == pytest.approx(30.0)
    assert threshold_in(apart((45, 5, 9, 10, 200), (*BAR[:4], 50))) == pytest.approx(100.0)


def test_the_threshold_stays_above_the_noise_of_the_ground() -> None:
    """Ground at 40 on a body of 48: half of the rest is 44, the noise reaches 41.5."""
    picture = apart(BAR)
    ground = np.where(picture > 0, 48, 40).astype(np.uint8)
    assert threshold_in(ground) == pytest.approx(44.0)
