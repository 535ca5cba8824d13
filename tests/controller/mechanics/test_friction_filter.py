"""The friction filter: what was planted in made-up slides comes back, and nothing else."""

import numpy as np
import pytest

from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.friction_filter import (
    FoundFriction,
    FrictionFilter,
    slide_evidence,
)

FILE = FrictionConfig(along=0.1, across=0.7)
SIGMA = np.array([0.012, 0.012, 0.035])
SPAN_S = 1.5


def slide(friction: FrictionConfig, rng: np.random.Generator) -> np.ndarray:
    """A slide (3,) that bends a little with the logarithms, another in each span."""
    a, b = np.log(friction.along / 0.1), np.log(friction.across / 0.7)
    slopes = np.array([[-0.09, 0.12], [0.04, -0.08], [0.15, 0.3]]) * rng.uniform(0.3, 1.5, (3, 2))
    return np.asarray(slopes @ [a + 0.2 * a * a, b - 0.2 * a * b])


def run(planted: FrictionConfig, seed: int, spans: int = 40) -> list[FoundFriction]:
    """Find a friction from slides with noise."""
    found, about = [], FrictionFilter(FILE, SIGMA)
    noise = np.random.default_rng(seed + 1000)
    for k in range(spans):
        predicted = np.array(
            [slide(h, np.random.default_rng([seed, k])) for h in about.hypotheses()]
        )
        measured = slide(planted, np.random.default_rng([seed, k]))
        found.append(about.update(measured + 0.3 * SIGMA * noise.normal(size=3), predicted, SPAN_S))
    return found


@pytest.mark.parametrize("factors", [(1.3, 0.8), (0.7, 1.2), (2.0, 1.0), (1.0, 0.5)])
def test_a_planted_friction_is_found_within_its_interval(factors: tuple[float, float]) -> None:
    planted = FrictionConfig(along=0.1 * factors[0], across=0.7 * factors[1])
    for seed in range(5):
        last = run(planted, seed)[-1]
        assert last.differs
        assert last.along_95[0] < planted.along < last.along_95[1]
        assert last.across_95[0] < planted.across < last.across_95[1]
        assert last.along_95[1] < 1.8 * last.along_95[0]


def test_the_files_friction_stays_where_the_ground_has_it() -> None:
    assert not any(found.differs for seed in range(20) for found in run(FILE, seed))


def test_what_is_not_finite_tells_nothing() -> None:
    about = FrictionFilter(FILE, SIGMA)
    before = about.found
    predicted = np.zeros((3, 3))
    for bad in (np.nan, np.inf):
        told = np.where(np.eye(3) > 0.0, bad, predicted)
        assert about.update(np.array([0.1, 0.0, 0.0]), told, SPAN_S) == before
        assert about.update(np.array([0.1, bad, 0.0]), predicted, SPAN_S) == before


def test_a_body_that_is_carried_off_is_not_believed() -> None:
    """One span in which it goes a metre astray leaves the estimate within its interval."""
    about = FrictionFilter(FILE, SIGMA)
    predicted = np.array([[0.2, 0.0, 0.0], [0.19, 0.003, 0.01], [0.21, -0.003, 0.02]])
    for _ in range(20):
        about.update(predicted[0], predicted, SPAN_S)
    before = about.found
    after = about.update(np.array([1.2, 1.0, 2.0]), predicted, SPAN_S)
    assert before.along_95[0] < after.friction.along < before.along_95[1]
    assert before.across_95[0] < after.friction.across < before.across_95[1]
    assert not after.differs


@pytest.mark.parametrize(("ratio", "is_estimated"), [(-1.0, True), (0.0, False)])
def test_friction_is_estimated_once_both_intervals_are_narrower(
    ratio: float, is_estimated: bool
) -> None:
    """The ratio of the frictions narrows both; motion that shows one of them is not enough."""
    u = 1.0 + ratio
    direction = np.array([u, 1.0])
    evidence = slide_evidence(400.0 * np.outer(direction, direction), np.zeros(2), 0.0, 3)
    found = FrictionFilter(FILE).absorb(evidence, SPAN_S)
    assert found.is_estimated == is_estimated


def test_a_turn_around_is_not_a_turn_of_the_friction() -> None:
    about, other = FrictionFilter(FILE, SIGMA), FrictionFilter(FILE, SIGMA)
    predicted = np.array([[0.2, 0.0, 0.1], [0.19, 0.003, 0.2], [0.21, -0.003, 0.3]])
    measured = np.array([0.2, 0.01, 0.15])
    one = about.update(measured, predicted, SPAN_S)
    two = other.update(measured + np.array([0.0, 0.0, 2.0 * np.pi]), predicted, SPAN_S)
    np.testing.assert_allclose(one.along_95, two.along_95, rtol=1e-9)


def test_without_news_it_returns_to_the_file() -> None:
    about = FrictionFilter(FILE, SIGMA)
    predicted = np.array([[0.2, 0.0, 0.0], [0.19, 0.003, 0.01], [0.21, -0.003, 0.02]])
    for _ in range(20):
        about.update(predicted[1] * [1.0, 1.0, 2.0], predicted, SPAN_S)
    assert about.found.friction.along > 0.105
    for _ in range(10):
        about.update(np.full(3, np.nan), predicted, 20.0)
    assert abs(about.found.friction.along - 0.1) < 1e-3
    assert about.found.along_95 == pytest.approx((0.0457, 0.219), rel=0.01)


def test_friction_backward_goes_with_that_along() -> None:
    scaled = FrictionConfig(along=0.2, across=0.7, back=0.4)
    first, *others = FrictionFilter(scaled, SIGMA).hypotheses()
    assert first == scaled
    assert [each.back for each in others] == pytest.approx([2.0 * each.along for each in others])


def textbook(
    file: FrictionConfig, spans: list[tuple[np.ndarray, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """Mean (2,) and covariance (2, 2) of the logarithms, by matrices."""
    mean, covariance, prior = np.zeros(2), 0.16 * np.eye(2), 0.16 * np.eye(2)
    axes = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2.0)
    for measured, predicted in spans:
        kept = np.exp(-SPAN_S / 40.0)
        covariance = kept**2 * covariance + (1.0 - kept**2) * prior
        slopes = (predicted[1:] - predicted[0]).T / 0.1 @ axes
        gap, noise = measured - predicted[0], np.diag(SIGMA**2) + 0.01 * slopes @ slopes.T
        spread = slopes @ covariance @ slopes.T
        excess = max(1.0, gap @ np.linalg.solve(spread + noise, gap) / 3.0)
        gain = covariance @ slopes.T @ np.linalg.inv(spread + excess * noise)
        mean = kept * (mean + gain @ gap)
        covariance = covariance - gain @ slopes @ covariance
    return mean, covariance


def test_it_is_the_textbooks_filter() -> None:
    rng = np.random.default_rng(5)
    about = FrictionFilter(FILE, SIGMA)
    spans = []
    for size in (0.8, 1.0, 2.0, 0.2, 3.0):
        here = 0.1 * rng.normal(size=3)
        rows = np.array([here, *(here + 0.01 * rng.normal(size=(2, 3)))])
        spans.append((here + size * SIGMA * rng.normal(size=3), rows))
        about.update(*spans[-1], SPAN_S)
    mean, covariance = textbook(FILE, spans)
    found = about.found
    half = 1.96 * np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        np.log([found.friction.along / 0.1, found.friction.across / 0.7]), mean, rtol=1e-9
    )
    np.testing.assert_allclose(
        np.log(np.divide(found.along_95, 0.1)), mean[0] + half[0] * np.array([-1, 1]), rtol=1e-9
    )
    np.testing.assert_allclose(
        np.log(np.divide(found.across_95, 0.7)), mean[1] + half[1] * np.array([-1, 1]), rtol=1e-9
    )
