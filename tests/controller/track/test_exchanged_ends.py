"""Frames whose head and tail a tracker exchanged are turned round, and only those."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.controller.track.analysis import analyse
from snakewalk.controller.track.choice import ALL
from snakewalk.controller.track.exchanged_ends import with_ends_in_place
from snakewalk.controller.track.readers.keypoints import Keypoints

FRAMES = 400
RATE_HZ = 50.0


def swimming(spacing: float = 1.0, seed: int = 0) -> Floats:
    """(T, 9, 2) a wave of 1 Hz towards the tail; keypoints even, or closer towards the tail."""
    random = np.random.default_rng(seed)
    along = np.linspace(0.0, 1.0, 9) ** spacing
    t_s = np.arange(FRAMES)[:, None] / RATE_HZ
    heading = 0.6 * np.cos(2.0 * np.pi * (along[:-1] - t_s)) + 0.3 * t_s
    step = np.diff(along) * np.stack([-np.cos(heading), -np.sin(heading)])
    body = np.concatenate([np.zeros((2, FRAMES, 1)), np.cumsum(step, axis=2)], axis=2)
    body += 0.1 * t_s.T[..., None]
    return np.asarray(body.transpose(1, 2, 0) + random.normal(0.0, 0.003, (FRAMES, 9, 2)))


def stretches(share: float, seed: int) -> Floats:
    """(T,) frames in stretches of 3 to 20 that make up about ``share`` of all."""
    random = np.random.default_rng(seed)
    which = np.zeros(FRAMES, dtype=bool)
    while which.mean() < share:
        first = random.integers(1, FRAMES - 20)
        which[first : first + random.integers(3, 21)] = True
    return which


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("spacing", [1.0, 1.3])
def test_exchanged_frames_are_turned_round(spacing: float, seed: int) -> None:
    truth = swimming(spacing, seed)
    which = stretches(0.05 + 0.04 * seed, seed)
    given = truth.copy()
    given[which] = given[which, ::-1]
    found, notes = with_ends_in_place(given, np.arange(FRAMES))
    np.testing.assert_array_equal(found, truth)
    first = int(np.argmax(which))
    assert notes[0].startswith(
        f"head and tail were exchanged in {which.sum()} of 400 frames, the first of them frame "
        f"{first}, "
    )


def test_exchanged_labels_of_the_ends_alone_are_put_in_place() -> None:
    truth = swimming()
    which = stretches(0.2, 3)
    given = truth.copy()
    given[np.ix_(which, [0, -1])] = truth[np.ix_(which, [-1, 0])]
    found, notes = with_ends_in_place(given, np.arange(FRAMES))
    np.testing.assert_array_equal(found, truth)
    assert len(notes) == 1
    assert "only the end points were exchanged in" in notes[0]


def test_an_animal_that_turns_or_rests_is_left_as_it_is() -> None:
    swims = swimming()
    rests = np.repeat(swims[:1], FRAMES, axis=0)
    angle_rad = np.interp(np.arange(FRAMES), [200, 205], [0.0, np.pi])  # a half turn in 0.1 s
    c = np.cos(angle_rad)
    s = np.sin(angle_rad)
    turns = np.einsum("tij,tpj->tpi", np.stack([[c, -s], [s, c]]).transpose(2, 0, 1), swims - 0.5)
    for body in (swims, rests, turns):
        found, notes = with_ends_in_place(body, np.arange(FRAMES))
        assert notes == ()
        np.testing.assert_array_equal(found, body)


def test_nothing_is_compared_over_a_gap() -> None:
    body = swimming()
    body[200:] = body[200:, ::-1]
    number = np.arange(FRAMES)
    number[200:] += 50
    assert with_ends_in_place(body, number)[1] == ()


def test_a_head_without_a_clear_majority_is_reported() -> None:
    body = swimming()
    body[210:] = body[210:, ::-1]
    notes = with_ends_in_place(body, np.arange(FRAMES))[1]
    assert len(notes) == 2
    assert "the head may be the other end" in notes[1]


def test_the_frequency_is_right_and_the_exchange_is_noted() -> None:
    body = swimming()
    which = stretches(0.3, 5)
    body[which] = body[which, ::-1]
    names = tuple(f"p{k}" for k in range(9))
    keypoints = Keypoints(Path("swim.csv"), names, body, None, RATE_HZ)
    facts = analyse(keypoints.track(ALL)).facts()
    assert facts["frequency_hz"] == pytest.approx(1.0, rel=0.01)
    assert any("head and tail were exchanged in" in note for note in facts["notes"])
