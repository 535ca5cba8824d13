"""Motions that agree best with all matches, against motions of which the matches are made."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.controller.mapping.mosaic.adjustment import Sightings, adjusted, composed
from snakewalk.controller.mapping.mosaic.local_model import LocalModel
from snakewalk.controller.mapping.stereo_ground import DISPARITY_ERROR_PX

K = np.array([[400.0, 0.0, 239.5], [0.0, 400.0, 179.5], [0.0, 0.0, 1.0]])
BLANK = LocalModel(np.ones((360, 480, 3)), np.zeros((360, 480, 3), np.uint8), K, 0.1)
MOTIONS = np.stack(
    [
        np.column_stack([Rotation.from_rotvec(turn).as_matrix(), shift])
        for turn, shift in (
            ([0.02, -0.15, 0.01], [0.1, 0.02, -0.8]),
            ([-0.03, 0.10, 0.02], [-0.05, 0.0, -0.9]),
        )
    ]
)


def sightings(pair: tuple[int, int], seed: int, noise: float, count: int = 150) -> Sightings:
    """Points of a floor and walls, with errors of place and of both disparities."""
    rng = np.random.default_rng(seed)
    motion = composed(MOTIONS, *pair)
    points = np.column_stack(
        [rng.uniform(-1.0, 1.0, count), rng.uniform(-0.3, 0.5, count), rng.uniform(2.2, 5.0, count)]
    )
    moved = points @ motion[:, :3].T + motion[:, 3]
    group = Sightings(*pair, points, np.zeros((count, 3)), np.ones(count), (BLANK, BLANK))
    seen = group.predicted_px(moved)
    seen[:, :2] += noise * rng.normal(0.0, 0.3, (count, 2))
    seen[:, 2] += noise * rng.normal(0.0, DISPARITY_ERROR_PX, count)
    disparity = 40.0 / points[:, 2]
    wrong = disparity + noise * rng.normal(0.0, DISPARITY_ERROR_PX, count)
    return Sightings(
        *pair, points * (disparity / wrong)[:, None], seen, group.scale, (BLANK, BLANK)
    )


def start() -> Floats:
    """Motions that are 40 mm and 20 mrad off."""
    turn = Rotation.from_rotvec([0.0, 0.02, 0.0]).as_matrix()
    off = MOTIONS.copy()
    off[:, :, :3] = turn @ off[:, :, :3]
    off[:, 2, 3] += 0.04
    return off


def places(motions: Floats) -> Floats:
    return np.stack([-motion[:, :3].T @ motion[:, 3] for motion in motions])


def test_exact_matches_give_the_motions() -> None:
    groups = [sightings(pair, 1, 0.0) for pair in ((0, 1), (1, 2), (0, 2))]
    assert adjusted(groups, start()).motions == pytest.approx(MOTIONS, abs=1e-6)


def test_matches_that_are_wrong_do_not_count() -> None:
    group = sightings((0, 1), 2, 0.0)
    group.seen_px[:30, :2] += 25.0
    group.seen_px[30:50, 2] = np.nan  # without a depth in the second picture
    found = adjusted([group], start()[:1])
    assert not found.agrees[0][:30].any()
    assert found.agrees[0][30:].all()
    assert found.motions[0] == pytest.approx(MOTIONS[0], abs=1e-6)


@pytest.mark.slow
def test_the_standard_deviations_are_those_of_the_errors() -> None:
    """20 seeds: the squared error over the variance is 1 in the mean, and a third pair helps."""
    ratio = {2: [], 3: []}
    error = {2: [], 3: []}
    for seed in range(20):
        groups = [sightings(pair, 10 * seed + k, 1.0) for k, pair in enumerate(((0, 1), (1, 2)))]
        groups.append(sightings((0, 2), 10 * seed + 5, 1.0))
        for count in (2, 3):
            found = adjusted(groups[:count], start())
            off = np.linalg.norm(places(found.motions) - places(MOTIONS), axis=1)
            ratio[count].append((off / found.place_sd_m) ** 2)
            error[count].append(off)
    for count in (2, 3):
        assert 0.5 < np.mean(ratio[count]) < 1.7
    assert np.sqrt(np.mean(np.square(error[3]))) < np.sqrt(np.mean(np.square(error[2])))
