"""The kinds of wrong poses change what they say, and name public reports."""

import numpy as np
import pytest

from benchmarks.wrong_poses import KINDS, REPORTS
from snakewalk.controller.pose.sample import PoseSample, turned

FIRST = PoseSample(1, 100.0, np.array([0.5, -0.3, 0.03]), turned((2.0, -3.0, 40.0)), "lab")
LATER = PoseSample(2, 113.0, np.array([1.5, 0.4, 0.04]), turned((1.0, 4.0, 70.0)), "lab")


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"good"}))
def test_a_kind_changes_poses_and_keeps_rotations(kind: str) -> None:
    change = KINDS[kind]()
    made = [change(FIRST, FIRST, 0.0), change(LATER, FIRST, 13.0)]
    made += [change(LATER, FIRST, 13.0 + 0.2 * k) for k in range(1, 40)]
    sent = [FIRST, *[LATER] * 40, FIRST]
    made.append(change(FIRST, FIRST, 22.0))
    is_other = [
        not np.allclose(a.position_m, b.position_m)
        or not np.allclose(a.rotation, b.rotation)
        or a.time_s != b.time_s
        for a, b in zip(made, sent, strict=True)
    ]
    assert any(is_other)
    for pose in made:
        np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-9)
        assert np.linalg.det(pose.rotation) == pytest.approx(1.0)


def test_each_report_belongs_to_a_kind() -> None:
    assert set(REPORTS) < set(KINDS)
    assert all(address.startswith("https://") for address in REPORTS.values())
