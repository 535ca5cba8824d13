"""Commands on their way to the run: the same when they arrive, and refused when they are late."""

import json
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


GOALS = {"kind": "goals", "joints": ["joint0"], "position_rad": [0.1]}
TRAJECTORY = json.loads(encode_command(JointTrajectory(["joint0"], np.ones(1), np.zeros((1, 1)))))
DAMAGED = [
    "",
    "0.1, 0.2]",  # the end of a line that was cut
    "[" * 100_000,
    '{"kind":' * 5000,
    "null",
    "[]",
    "{}",
    '"goals"',
    "\ufffd\ufffd",
    json.dumps({"kind": "goals"}),
    json.dumps({"kind": ["goals"]}),
    json.dumps({"kind": "dance"}),
    json.dumps(GOALS | {"joints": "joint0"}),
    json.dumps(GOALS | {"joints": [0]}),
    json.dumps(GOALS | {"position_rad": [[0.1]]}),
    json.dumps(GOALS | {"position_rad": ["nonsense"]}),
    json.dumps(GOALS | {"position_rad": [10**400]}),
    json.dumps(GOALS | {"position_rad": None}),
    json.dumps(TRAJECTORY | {"position_rad": None}),
    json.dumps(TRAJECTORY | {"time_s": None}),
    json.dumps(TRAJECTORY | {"time_s": [[1], "no base64!"]}),
    json.dumps(TRAJECTORY | {"time_s": [[-1, -1], TRAJECTORY["time_s"][1]]}),
    json.dumps(TRAJECTORY | {"position_rad": [[10**9, 10**9], "AAAA"]}),
    json.dumps({"kind": "gait", "name": ["rolling"], "parameters": {}}),
    json.dumps({"kind": "gait", "name": "rolling", "parameters": [1]}),
    json.dumps({"kind": "refused"}),
]


def dated(line: str) -> str:
    """The same with the current time, if it is an object."""
    try:
        row = json.loads(line)
    except (ValueError, RecursionError):
        return line
    return json.dumps(row | {"sent_s": time.monotonic()}) if isinstance(row, dict) else line


@pytest.mark.parametrize("line", DAMAGED, ids=lambda line: line[:60])
def test_a_damaged_line_is_an_input_error_and_nothing_else(line: str) -> None:
    with pytest.raises(InputError) as caught:
        decode_command(dated(line))
    (why,) = caught.value.faults
    assert len(why.splitlines()) == 1


@pytest.mark.parametrize("kind", ["goals", "trajectory", "gait"])
@pytest.mark.parametrize("sent_s", [math.nan, math.inf, 1e300])
def test_a_command_of_the_future_is_rejected(kind: str, sent_s: float) -> None:
    got = decode_command(json.dumps(GOALS | {"kind": kind, "sent_s": sent_s}), lambda: 5.0)
    assert isinstance(got, Refused)
    assert "ahead of this machine" in got.why


@pytest.mark.parametrize(
    "command",
    [
        JointGoals([f"joint{k}" for k in range(75_000)], [0.0] * 75_000),
        JointTrajectory(["joint0"] * 200, np.arange(500.0), *[np.zeros((500, 200))] * 2),
        Refused("x" * 2_000_000),
    ],
)
def test_a_command_over_a_megabyte_is_sent_as_one_short_line(command: Command) -> None:
    line = encode_command(command)
    assert len(line) < 500
    got = decode_command(line)
    assert isinstance(got, Refused)
    assert got.why.endswith("MB; at most 1.0 MB is accepted")


def test_the_largest_trajectory_that_is_promised_passes() -> None:
    values = np.zeros((500, 64))
    names = [f"joint{k}" for k in range(64)]
    sent = JointTrajectory(names, np.arange(500.0), values, values)
    assert isinstance(decode_command(encode_command(sent)), JointTrajectory)
