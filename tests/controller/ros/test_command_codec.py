"""Commands on their way to the run: the same when they arrive, and refused when they are late."""

import math
import time

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.motion.command import (
    Command,
    HoldStill,
    JointGoals,
    JointTrajectory,
    Refused,
    StartGait,
)
from snakewalk.controller.ros.command_codec import LATE_S, decode_command, encode_command


@pytest.mark.parametrize(
    "command",
    [
        JointGoals(["joint1", "joint0"], [0.1 + 0.2, -math.inf]),
        JointGoals([], []),
        HoldStill(),
        Refused("why"),
    ],
)
def test_a_command_arrives_as_it_was_sent(command: Command) -> None:
    line = encode_command(command)
    assert "\n" not in line
    assert decode_command(line) == command


def test_a_trajectory_arrives_to_the_last_bit_with_what_is_no_number() -> None:
    rng = np.random.default_rng(5)
    times, angles, speeds = np.arange(3.0), rng.normal(size=(3, 2)), rng.normal(size=(3, 2))
    speeds[1, 0] = np.nan
    sent = JointTrajectory(["a", "b"], times, angles, speeds)
    got = decode_command(encode_command(sent))
    assert isinstance(got, JointTrajectory)
    assert got.joints == sent.joints
    assert got.acceleration_rad_s2 is None
    for ours, theirs in zip(sent[1:4], got[1:4], strict=True):
        assert np.array_equal(ours, theirs, equal_nan=True)  # type: ignore[arg-type]


def test_a_gait_arrives_with_its_parameters_and_is_checked_again() -> None:
    line = encode_command(StartGait(make_gait("rolling", {"frequency_hz": 0.25})))
    got = decode_command(line)
    assert isinstance(got, StartGait)
    assert got.gait.name == "rolling"
    assert got.gait.params.frequency_hz == 0.25
    with pytest.raises(InputError):
        decode_command(line.replace("0.25", "-9.0"))


def test_what_waited_too_long_moves_nothing_but_may_still_stop() -> None:
    late = time.monotonic() + 2.0 * LATE_S
    got = decode_command(encode_command(JointGoals(["joint0"], [0.1])), lambda: late)
    assert isinstance(got, Refused)
    assert got.why.startswith("goals: waited 1.0 s for the run")
    assert decode_command(encode_command(HoldStill()), lambda: late) == HoldStill()
