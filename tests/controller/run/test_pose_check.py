"""``pose check`` on poses in simulated time, and its answer."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from snakewalk.config.pose import PoseConfig
from snakewalk.controller.pose.sample import ArrivedPose, PoseSample, UnusablePoseError, turned
from snakewalk.controller.run.commands.pose_check import expected_pose, start_faults, watch
from snakewalk.controller.run.factory import prepare_job
from snakewalk.drivers.attitude import rotation_by
from snakewalk.sim.line.clock import SimClock
from tests.helpers.command import snakewalk


class Tracker:
    """Sends a noisy pose at 100 Hz, every tenth 30 ms late."""

    def __init__(self) -> None:
        self.rng, self.count = np.random.default_rng(3), 0

    def arrived(self, now_s: float) -> list[ArrivedPose]:
        found = []
        while self.count * 0.01 <= now_s - 0.03:
            stamp_s = self.count * 0.01
            rotation = turned((0.0, 0.0, 90.0)) @ rotation_by(0.02 * self.rng.standard_normal(3))
            position = np.array([1.0, 2.0, 0.1]) + 0.004 * self.rng.standard_normal(3)
            late_s = 0.03 if self.count % 10 == 9 else 0.0
            sample = PoseSample(self.count, stamp_s - 77.0, position, rotation, "lab")
            found.append(ArrivedPose(stamp_s + late_s, "10.0.0.1:1", sample))
            self.count += 1
        return found


def test_the_statistics_are_those_of_the_tracker() -> None:
    lines: list[str] = []
    config = PoseConfig(world_m=(0.0, -2.0, 0.0), offset_m=(0.0, 0.0, 0.05))
    found = watch(Tracker(), SimClock(), 5.0, config, lines.append)
    facts = found.facts()
    assert facts["rate_hz"] == pytest.approx(100.0, rel=0.02)
    assert facts["noise_m"] == pytest.approx(0.004, rel=0.15)
    assert facts["noise_deg"] == pytest.approx(np.degrees(0.02), rel=0.15)
    assert facts["jitter_max_s"] == pytest.approx(0.03, abs=0.002)
    assert facts["position_m"] == pytest.approx([1.0, 0.0, 0.05], abs=0.03)
    assert facts["heading_deg"] == pytest.approx(90.0, abs=6.0)
    assert found.faults() == []
    assert len(lines) >= 4
    for part in ("rate 100", "delay beyond the quickest 0.00", "noise 0.00", " deg", "frame lab"):
        assert part in lines[-1]


def test_the_seconds_begin_with_the_first_pose() -> None:
    class Late(Tracker):
        def arrived(self, now_s: float) -> list[ArrivedPose]:
            return super().arrived(now_s - 3.0)

    found = watch(Late(), SimClock(), 1.0, PoseConfig(), lambda line: None)
    assert len(found.senders) == 1
    assert found.facts()["poses"] == pytest.approx(100, abs=8)


def test_drift_and_heading_are_compared_as_in_a_run() -> None:
    """Millimetres of drift and a frame that is turned by 90 degrees."""

    class Drifting(Tracker):
        def arrived(self, now_s: float) -> list[ArrivedPose]:
            drift_m = np.array([0.02 * now_s, 0.0, 0.0])
            return [
                replace(each, sample=replace(pose, position_m=pose.position_m + drift_m))
                for each in super().arrived(now_s)
                if isinstance(pose := each.sample, PoseSample)
            ]

    _, judge = expected_pose(None, prepare_job("flat-slalom", start_m=(1.0, 1.6)))
    still = watch(Tracker(), SimClock(), 5.0, PoseConfig(), lambda line: None)
    (said,) = start_faults(still, judge)
    assert re.match(r"the robot is 0\.40 m behind its start and 0\.0\d m to the left", said)
    assert re.search(r"turned by \+17\d degrees if its body is straight", said)
    found = watch(Drifting(), SimClock(), 5.0, PoseConfig(), lambda line: None)
    assert re.search(r"the pose moves by 2\.\d cm/s", start_faults(found, lambda sample: None)[0])


class Wrong:
    def arrived(self, now_s: float) -> list[ArrivedPose]:
        one = PoseSample(0, now_s, np.zeros(3), np.eye(3), "lab")
        two = PoseSample(1, now_s, np.zeros(3), np.eye(3), "room")
        fault = UnusablePoseError("not finite")
        return [
            ArrivedPose(now_s, "a:1", one),
            ArrivedPose(now_s, "b:1", two),
            ArrivedPose(now_s, "a:1", fault),
        ]


def test_two_senders_and_frames_are_faults() -> None:
    found = watch(Wrong(), SimClock(), 0.1, PoseConfig(), lambda line: None)
    assert [text.partition(":")[0] for text in found.faults()] == ["two senders"]
    assert found.invalid > 0
    named = watch(Wrong(), SimClock(), 0.1, PoseConfig(sender="a"), lambda line: None)
    assert named.faults()[0] == "b:1 is ignored: it is not a (pose.sender)"


def test_without_a_sender_the_command_ends_with_1() -> None:
    ended = snakewalk("pose", "check", "udp:59870", "--seconds", "0.1", "--json")
    assert ended.returncode == 1
    assert json.loads(ended.stdout)["faults"] == ["nothing arrived; start the sender"]
    ended = snakewalk("pose", "check", "joints")
    assert ended.returncode == 2
    assert "do not come from another program" in ended.stderr
