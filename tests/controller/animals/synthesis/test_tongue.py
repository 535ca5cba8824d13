"""The tongue's chain: probabilities, only learned transitions, seeds, speed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.controller.animals.synthesis.tongue import HeightChain, Tongue, flicks

CHAIN = HeightChain(flicks())


def test_rows_of_seen_pairs_are_probabilities() -> None:
    total = CHAIN.probability.sum(axis=2)
    assert ((np.abs(total - 1) < 1e-12) | (total == 0)).all()
    assert 0 < np.count_nonzero(total) < total.size


@settings(max_examples=20)
@given(st.integers(0, 1000))
def test_only_learned_triples_occur(seed: int) -> None:
    drawn = CHAIN.sequence(400, np.random.default_rng(seed))
    k = np.rint(drawn * 8).astype(int)
    assert (CHAIN.probability[k[:-2], k[1:-1], k[2:]] > 0).all()


def test_a_cycle_without_choice_is_repeated_for_ever() -> None:
    saw = np.array([0.0, 0.5, 1.0, 0.5])
    drawn = HeightChain(saw, levels=3).sequence(8, np.random.default_rng(0))
    # from the first pair on; one look back could not tell the way up from the way down
    np.testing.assert_allclose(drawn, [1.0, 0.5, 0.0, 0.5] * 2)


def test_the_share_of_time_out_is_the_learned_one() -> None:
    out = (CHAIN.sequence(40_000, np.random.default_rng(1)) > 0.5).mean()
    assert out == pytest.approx((flicks() > 0.5).mean(), abs=0.05)


def test_the_same_seed_plays_the_same_and_faster_plays_it_sooner() -> None:
    times = np.linspace(0.0, 40.0, 60)
    plain, again = (Tongue(CHAIN, 3) for _ in range(2))
    heights = [plain.height(t) for t in times]
    assert heights == [again.height(t) for t in times[::-1]][::-1]
    fast = Tongue(CHAIN, 3, speed=2.0)
    np.testing.assert_allclose([fast.height(t / 2) for t in times], heights, atol=1e-9)
    assert heights != [Tongue(CHAIN, 4).height(t) for t in times]
    assert max(heights) > 0.9


@pytest.mark.parametrize("speed", [0.3, 2.6])
def test_speeds_outside_the_paper_s_range_are_refused(speed: float) -> None:
    with pytest.raises(ValueError, match=r"expected 0\.4 to 2\.5"):
        Tongue(CHAIN, 0, speed=speed)


def test_too_little_to_learn_from_is_refused() -> None:
    for heights in (np.array([0.0, 1.0]), np.array([0.0, 1.5, 0.0])):
        with pytest.raises(ValueError, match="three or more heights"):
            HeightChain(heights)
