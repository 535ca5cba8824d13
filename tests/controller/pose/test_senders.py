"""One state machine decides which messages are those of the source."""

import numpy as np
import pytest

from snakewalk.controller.pose.sample import ArrivedPose, PoseSample, UnusablePoseError
from snakewalk.controller.pose.senders import Senders


def message(
    at_s: float, sequence: int, sender: str = "a:1", stamp_s: float | None = None
) -> ArrivedPose:
    stamp = at_s if stamp_s is None else stamp_s
    return ArrivedPose(at_s, sender, PoseSample(sequence, stamp, np.zeros(3), np.eye(3), "lab"))


def test_poses_follow_each_other_and_lost_ones_are_counted() -> None:
    senders = Senders()
    orders = [senders.place(message(0.1 * k, k)).order for k in (0, 1, 4, 5)]
    assert orders == ["next"] * 4
    assert senders.lost == 2


def test_a_late_pose_does_not_become_the_newest() -> None:
    senders = Senders()
    for k in (3, 4):
        senders.place(message(0.1 * k, k))
    assert senders.place(message(0.5, 3, stamp_s=0.3)).order == "late"
    assert senders.newest is not None
    assert senders.newest.arrival_s == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("later", "words"),
    [
        (message(1.1, 0, stamp_s=-500.0), "its sequence begins again at 0"),
        (message(1.1, 12, stamp_s=-8.9), "its clock was set back by 9.9 s"),
        (message(2.5, 0, "a:2"), "another sender on the same host, a:2"),
    ],
)
def test_a_sender_begins_again(later: ArrivedPose, words: str) -> None:
    senders = Senders()
    senders.place(message(1.0, 10))
    assert senders.place(later) == ("restarted", words)
    assert senders.newest is later


def test_another_host_is_ignored_also_after_a_pause() -> None:
    senders = Senders()
    senders.place(message(0.0, 0))
    for at_s in (0.1, 9.0):
        placed = senders.place(message(at_s, 1, "b:1"))
        assert placed.order == "other"
        assert "two senders: b:1 is ignored, a:1 was first" in placed.text


def test_a_named_host_is_the_only_one() -> None:
    senders = Senders("b")
    assert senders.place(message(0.0, 0)).text == "a:1 is ignored: it is not b (pose.sender)"
    assert senders.place(message(0.1, 0, "b:1")).order == "next"


def test_a_message_without_a_pose_makes_no_sender_the_first() -> None:
    senders = Senders()
    senders.place(ArrivedPose(0.0, "b:1", UnusablePoseError("not JSON")))
    assert senders.place(message(0.1, 0)).order == "next"
    assert senders.place(message(0.2, 0, "b:1")).order == "other"
