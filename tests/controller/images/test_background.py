"""The ground from many frames: quantiles of each pixel."""

import numpy as np
import pytest

from snakewalk.controller.images.background import background_candidates, median_background


@pytest.mark.parametrize("count", [1, 2, 9, 25])
@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_candidates_are_the_frames_in_order_at_each_pixel(count: int, kind: type) -> None:
    rng = np.random.default_rng(count)
    frames = [rng.integers(0, 256, (7, 5)).astype(kind) for _ in range(count)]
    before = [frame.copy() for frame in frames]
    ordered = np.sort(np.stack(frames), axis=0)
    expected = [ordered[round(share * (count - 1))] for share in (0.5, 0.85, 0.15)]
    found = [ground for ground, _, _ in background_candidates(frames)]
    assert np.array_equal(found, expected)
    assert found[0].dtype == kind
    assert np.array_equal(median_background(frames), expected[0])
    assert np.array_equal(frames, before)
