"""Drawn larvae that rest or move, with a tail that one frame hardly shows."""

from collections.abc import Iterable, Iterator

import numpy as np
import pytest

from snakewalk.config.arrays import DeepImage, Image
from snakewalk.controller.images.body_detector import BodyDetector, Detection
from snakewalk.controller.images.resting import Neighbours, with_neighbours
from snakewalk.controller.images.silhouette import Polarity
from tests.oracles.drawn_larva import GROUND, NOISE, larva

TIP = np.array([149.0, 100.0])


@pytest.fixture
def larvae() -> list[Image]:
    """Frames of a resting larva with a straight tail of two deviations of the noise."""
    return [larva(0.0, seed, 2.0 * NOISE) for seed in range(7)]


def _detector() -> BodyDetector:
    background = np.full((200, 240), round(GROUND), dtype=np.uint8)
    return BodyDetector(background, Polarity.DARK, "given")


def _in_order(frames: list[DeepImage]) -> Iterator[tuple[DeepImage, Neighbours]]:
    return with_neighbours(lambda number: frames[number:])


def _tip_off_px(found: Detection) -> float:
    ends = found.skeleton.points_px[[0, -1]]
    return float(np.hypot(*(ends - TIP).T).min())


def test_the_tip_of_a_resting_larva_is_nearer_to_the_truth(larvae: list[Image]) -> None:
    detector = _detector()
    alone = [detector.detect(frame) for frame in larvae]
    found = [detector.detect(frame, neighbours=near) for frame, near in _in_order(larvae)]
    off_px = np.array([_tip_off_px(one) for one in found])
    assert off_px.max() < 3.0
    assert np.median(off_px) < 0.5 * np.median([_tip_off_px(one) for one in alone])
    for one, other in zip(found, alone, strict=True):
        if one.tip is not None and other.tip is not None:
            assert one.tip.error_px == other.tip.error_px
            longer_px = one.skeleton.length_px - other.skeleton.length_px
            assert one.tip.lengthening_px == pytest.approx(longer_px, abs=1.0)


def test_a_moving_larva_is_seen_in_its_own_frame_only(larvae: list[Image]) -> None:
    detector = _detector()
    moving = [np.roll(frame, 4 * k, axis=0) for k, frame in enumerate(larvae)]
    for frame, near in _in_order(moving):
        one, other = detector.detect(frame, neighbours=near), detector.detect(frame)
        assert np.array_equal(one.skeleton.points_px, other.skeleton.points_px)
        assert one.tip == other.tip


def test_a_larva_that_begins_to_move_is_averaged_with_the_frames_before(
    larvae: list[Image],
) -> None:
    moving = [np.roll(frame, 4 * max(0, k - 4), axis=0) for k, frame in enumerate(larvae)]
    found = [_detector().detect(frame, neighbours=near) for frame, near in _in_order(moving)]
    assert max(_tip_off_px(one) for one in found[:5]) < 3.0
    assert found[-1].tip == _detector().detect(moving[-1]).tip


NUMBERED = [np.full((3, 4), number, dtype=np.uint8) for number in range(12)]


def _numbers(pairs: Iterable[tuple[DeepImage, Neighbours]]) -> list[list[list[int]]]:
    """Numbers of each frame, of those before and of those after it."""
    return [
        [[int(one[0, 0]) for one in side] for side in ([frame], *near)] for frame, near in pairs
    ]


def test_neighbours_are_the_four_nearest_of_one_size() -> None:
    wider = np.full((3, 5), 7, dtype=np.uint8)
    numbers = _numbers(_in_order([*NUMBERED[:7], wider, *NUMBERED[8:]]))
    assert numbers[0] == [[0], [], [1, 2, 3, 4]]
    assert numbers[5] == [[5], [4, 3, 2, 1], [6, 8, 9]]
    assert numbers[7] == [[7], [], []]
    assert numbers[11] == [[11], [10, 9, 8], []]


@pytest.mark.parametrize("first", [0, 3, 9, 11, 12])
def test_a_resumed_film_has_the_neighbours_of_the_complete_one(first: int) -> None:
    resumed = with_neighbours(lambda number: NUMBERED[number:], first)
    assert _numbers(resumed) == _numbers(_in_order(NUMBERED))[first:]
