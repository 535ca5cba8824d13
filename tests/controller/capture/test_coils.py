"""Frames in which the body lies on itself: solved from both sides, or told why not."""

from collections.abc import Sequence

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import Image
from snakewalk.controller.capture.capture import Capture
from snakewalk.controller.capture.coil_film import CoilFilm, solve_coils
from snakewalk.controller.capture.coil_fit import Outline
from snakewalk.controller.capture.identity import align_ends
from snakewalk.controller.capture.stages.outlier_frames import mark_outliers
from snakewalk.controller.images.body_detector import make_detector
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.track.frame_status import FrameStatus
from tests.helpers.captured import capture
from tests.oracles.rendered_snake import SnakeScene, coiled_midlines, empty, film
from tests.oracles.skeleton_accuracy import point_error, swapped

SCENE = SnakeScene(
    rows=220, columns=260, length_px=125.0, frames=30, rate_hz=10.0, wave_hz=0.5, waves=1.2,
    bend_rad=0.8, seed=1,
)  # fmt: skip
TRUTH = coiled_midlines(SCENE)
UNSOLVED = {FrameStatus.COIL_ALONE, FrameStatus.COIL_TWO_WAYS, FrameStatus.COIL_UNLIKE}


@pytest.fixture(scope="module")
def images() -> list[Image]:
    return list(film(SCENE, TRUTH))


@pytest.fixture(scope="module")
def whole(images: list[Image]) -> Capture:
    return capture(images, make_detector(images[::3]), SCENE.rate_hz, fixed=False)


@pytest.fixture(scope="module")
def coils(whole: Capture) -> list[int]:
    """Frames that are solved."""
    return [k for k, one in enumerate(whole.status) if one is FrameStatus.COIL]


def detected(images: Sequence[Image]) -> tuple[list[Skeleton], dict[int, Outline]]:
    """Skeletons with one end first in all, coils without, and the silhouettes."""
    detector = make_detector(images[:1], empty(SCENE))
    found = [detector.detect(one) for one in images]
    outlines = {k: Outline.of(one.silhouette, 0.0) for k, one in enumerate(found)}
    areas = np.array([one.silhouette.area_px for one in found])
    aligned = align_ends([one.skeleton for one in found])
    return list(align_ends(mark_outliers(aligned, areas))), outlines


def solved(skeletons: list[Skeleton], outlines: dict[int, Outline]) -> CoilFilm:
    return solve_coils(skeletons, outlines, np.full(len(skeletons), 0.5))


def test_a_loop_is_solved_and_its_expected_error_holds(whole: Capture, coils: list[int]) -> None:
    assert len(coils) >= 5
    assert whole.used.all()
    for k in coils:
        both = [point_error(whole.points_px[k][::way], TRUTH[k]) for way in (1, -1)]
        assert min(both) < 2.0 * whole.expected_px[k]
        assert min(both) < 0.015 * SCENE.length_px
    assert np.allclose(whole.length_px[coils], SCENE.length_px, rtol=0.05)


def test_the_head_stays_the_head_through_a_coil(whole: Capture) -> None:
    ways = [swapped(whole.points_px[k], TRUTH[k]) for k in range(len(TRUTH))]
    assert len(set(ways)) == 1


def test_a_coil_with_which_the_film_ends_is_not_guessed(
    images: list[Image], coils: list[int]
) -> None:
    found = solved(*detected(images[: coils[-2]]))
    assert found.skeletons[-1].status is FrameStatus.COIL_ALONE
    assert not np.isfinite(found.skeletons[-1].points_px).any()
    assert np.isnan(found.expected_px).all()


@pytest.mark.slow
def test_what_the_body_does_not_explain_is_told_apart(
    images: list[Image], coils: list[int]
) -> None:
    covered = [one.copy() for one in images]
    for k in coils[2:-2]:  # something as light as the ground lies on a third of the body
        head = np.rint(TRUTH[k][12]).astype(int)
        cv2.circle(covered[k], (int(head[0]), int(head[1])), 22, int(SCENE.ground), -1)
    found = solved(*detected(covered))
    status = [found.skeletons[k].status for k in coils[2:-2]]
    assert not any(one.has_points for one in status)
    assert FrameStatus.COIL_UNLIKE in status


@pytest.mark.nightly("a further film: 2 s of CPU")
def test_ends_that_changed_places_in_a_coil_are_put_right(
    images: list[Image], coils: list[int]
) -> None:
    skeletons, outlines = detected(images)
    after = coils[-1] + 1
    skeletons[after:] = [one.reversed() for one in skeletons[after:]]
    found = solved(skeletons, outlines)
    ways = [
        swapped(one.points_px, TRUTH[k])
        for k, one in enumerate(found.skeletons)
        if np.isfinite(one.length_px)
    ]
    assert len(ways) > after
    assert len(set(ways)) == 1


def test_a_film_without_coils_is_left_as_it_is(images: list[Image], coils: list[int]) -> None:
    skeletons, outlines = detected(images[: coils[0] - 2])
    found = solved(skeletons, outlines)
    assert not UNSOLVED & {one.status for one in found.skeletons}
    assert all(one is other for one, other in zip(found.skeletons, skeletons, strict=True))
