"""The kinds of wrong poses change what is sent, and name public descriptions."""

import numpy as np
import pytest

from benchmarks.pose_errors import KINDS, Answer, Kind, source_of
from benchmarks.wrong_poses import WrongSource
from snakewalk.controller.pose.sample import ArrivedPose, PoseSample, UnusablePoseError, turned


def _sample(k: int) -> PoseSample:
    place_m = np.array([0.5 + 0.03 * k, -0.3 + 0.1 * np.sin(0.2 * k), 0.03])
    return PoseSample(
        k, 100.0 + 0.2 * k, place_m, turned((2.0, -3.0, 40.0 + 20.0 * np.sin(0.3 * k))), "lab"
    )


SAMPLES = [_sample(k) for k in range(120)]


def _sent(kind: Kind) -> list[PoseSample | UnusablePoseError]:
    source = WrongSource(kind.change())
    arrived = [ArrivedPose(each.time_s, "a:1", each) for each in SAMPLES]
    return [sent.sample for each in arrived for sent in source(each)]


def _are_alike(sent: Answer | UnusablePoseError, true: PoseSample) -> bool:
    if not isinstance(sent, PoseSample):
        return False
    return (
        np.allclose(sent.position_m, true.position_m)
        and np.allclose(sent.rotation, true.rotation)
        and (sent.time_s, sent.sequence, sent.frame) == (true.time_s, true.sequence, true.frame)
        and (sent.covariance is None) == (true.covariance is None)
    )


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_kind_changes_what_is_sent_and_keeps_rotations(kind: Kind) -> None:
    sent = _sent(kind)
    is_same = len(sent) == len(SAMPLES) and all(map(_are_alike, sent, SAMPLES))
    assert not is_same
    for pose in sent:
        if isinstance(pose, PoseSample):
            np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-9)
            assert np.linalg.det(pose.rotation) == pytest.approx(1.0)


def test_at_least_60_kinds_have_a_source() -> None:
    assert len({kind.name for kind in KINDS}) == len(KINDS) >= 60
    assert all(source_of(kind).startswith("https://") for kind in KINDS)
