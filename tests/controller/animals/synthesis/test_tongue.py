"""The tongue's chain: probabilities, only learned transitions, seeds, speed."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.mesh.rig import Rig, posed_m
from snakewalk.controller.animals.mesh.skin import Weights
from snakewalk.controller.animals.synthesis.synthesis_skin import (
    LENGTH,
    RADIUS,
    bones_with_tongue,
    rig_with_tongue,
)
from snakewalk.controller.animals.synthesis.tongue import (
    HeightChain,
    Tongue,
    TongueRecord,
    flicks,
)
from snakewalk.controller.images.mesh import Mesh
from snakewalk.controller.track.bone_motion import from_points

CHAIN = HeightChain(flicks())
NAMES = tuple(f"spine_{k:02d}" for k in range(5))
FLIP = np.array([1.0, -1.0, 1.0])


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
    fast = Tongue(CHAIN, 3, 50.0)
    np.testing.assert_allclose([fast.height(t / 2) for t in times], heights, atol=1e-9)
    assert heights != [Tongue(CHAIN, 4).height(t) for t in times]
    assert max(heights) > 0.9


def test_too_little_to_learn_from_is_refused() -> None:
    for heights in (np.array([0.0, 1.0]), np.array([0.0, 1.5, 0.0])):
        with pytest.raises(ValueError, match="three or more heights"):
            HeightChain(heights)


def test_a_known_chain_is_recovered_within_its_confidence_interval(tmp_path: Path) -> None:
    """From a table of a tracked length: 99.9 % intervals hold the planted probabilities."""
    rng = np.random.default_rng(4)
    known = rng.dirichlet(np.ones(3), size=(3, 3))  # (z, y, x)
    levels = [0, 1]
    for _ in range(6000):
        levels.append(int(rng.choice(3, p=known[levels[-2], levels[-1]])))
    file = tmp_path / "tongue.csv"
    rows = [f"{0.02 * k:.2f},{0.004 * level:.4f}" for k, level in enumerate(levels)]
    file.write_text("time_s,length_m\n" + "\n".join(rows))
    record = TongueRecord.read(file)
    assert record.rate_hz == pytest.approx(50.0)
    assert record.evidence == "measured"
    chain = HeightChain(record.heights, levels=3)
    counts = np.zeros((3, 3, 3))
    for triple in zip(levels, levels[1:], levels[2:], strict=False):
        counts[triple] += 1.0
    wide = []
    for two, one, next_ in np.ndindex(3, 3, 3):
        seen = binomtest(int(counts[two, one, next_]), int(counts[two, one].sum()))
        share = counts[two, one, next_] / counts[two, one].sum()
        assert chain.probability[two, one, next_] == pytest.approx(share, abs=0.01)
        interval = seen.proportion_ci(0.999, "wilson")
        assert interval.low <= known[two, one, next_] <= interval.high
        wide.append(interval.high - interval.low)
    assert np.median(wide) < 0.15
    assert TongueRecord.made_up().evidence == "assumed"


def test_a_pair_that_was_never_seen_has_no_estimate() -> None:
    chain = HeightChain(np.array([0.0, 0.5, 1.0, 0.5]), levels=3)
    assert chain.probability[0, 0].sum() == 0.0


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("time_s,x\n0,1", "the header must name time_s"),
        ("time_s,height\n0,0\n1,a\n2,0", "line 3: height: expected a number"),
        ("time_s,height\n0,0\n1,1\n5,0", "must rise evenly"),
        ("time_s,height\n0,0\n1,2\n2,0", "a height at most 1"),
    ],
)
def test_a_table_that_is_no_tongue_is_rejected(text: str, fault: str, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(InputError, match=fault):
        TongueRecord.read(tmp_path / "t.csv")


def test_the_tongue_of_the_skin_is_as_far_out_as_its_height() -> None:
    points = np.zeros((3, 6, 3))
    points[..., 0] = -0.2 * np.arange(6)
    bones = from_points(points, np.arange(3.0))
    moved = bones_with_tongue(bones, np.array([0.0, 0.5, 1.0]))
    corners = np.zeros((3, 3))
    mesh = Mesh(vertices=corners, normals=corners, uv=np.zeros((3, 2)), faces=np.array([[0, 1, 2]]))
    held = Weights(np.zeros((3, 3), dtype=np.int64), np.tile([0.0, 1.0, 0.0], (3, 1)))
    rest = points[0, :-1]
    rig, texture = rig_with_tongue(
        Rig(mesh, held, rest, np.arange(5) - 1, NAMES), 1.0, np.zeros((24, 4, 3), dtype=np.uint8)
    )
    assert texture is not None
    for frame, height in enumerate((0.0, 0.5, 1.0)):
        tongue = posed_m(rig, moved, frame)[3:]
        assert tongue[:, 0].max() == pytest.approx(0.05 * height - 0.0036, abs=1e-9)
        assert tongue[:, 0].min() < 1e-9  # its root stays in the mouth
    red = texture[int((1.0 - rig.mesh.uv[-1, 1]) * len(texture))]
    assert red[0, 0] > 150
    assert red[0, 1] < 60


@pytest.mark.parametrize("length_m", [0.5, 2.0])
def test_a_tongue_is_a_round_stem_with_two_mirrored_tips(length_m: float) -> None:
    mesh = Mesh(
        vertices=np.zeros((3, 3)),
        normals=np.eye(3),
        uv=np.zeros((3, 2)),
        faces=np.eye(3, dtype=int),
    )
    held = Weights(np.zeros((3, 3), dtype=np.int64), np.tile([0.0, 1.0, 0.0], (3, 1)))
    rig, _ = rig_with_tongue(
        Rig(mesh, held, np.zeros((5, 3)), np.arange(5) - 1, NAMES), length_m, None
    )
    corners_m = rig.mesh.vertices[3:] / length_m
    front, root = corners_m[:, 0].max(), corners_m[:, 0].min()
    assert front == pytest.approx(-2.0 * RADIUS)
    assert front - root == pytest.approx(LENGTH)
    ordered = [np.round(c[np.lexsort(np.round(c, 9).T)], 9) for c in (corners_m, corners_m * FLIP)]
    np.testing.assert_array_equal(*ordered)
    for x in (root, front - 0.35 * LENGTH):  # both ends of the stem
        ring = corners_m[np.abs(corners_m[:, 0] - x) < 1e-9]
        assert np.abs(ring[:, 2]).max() == pytest.approx(RADIUS)
    tips = corners_m[np.abs(corners_m[:, 0] - front) < 1e-9]
    assert np.abs(tips[:, 1]).min() > RADIUS, "they are apart"
