"""Datagrams, clocks and the first pose."""

import json
import math
import re

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.config.pose import PoseConfig
from snakewalk.controller.pose.datagram import decode_pose, encode_pose
from snakewalk.controller.pose.first_pose import WAIT_S, await_first_pose, start_fault
from snakewalk.controller.pose.sample import (
    ArrivedPose,
    PoseSample,
    UnusablePoseError,
    quaternion_of,
    rotation_of,
    turned,
)
from snakewalk.controller.pose.sender_clock import SenderClock
from snakewalk.controller.pose.udp_feed import UdpFeed, UdpSender, parse_address
from snakewalk.controller.runtime.pose_hold import PoseHealth, PoseHold
from snakewalk.drivers.clock import WallClock
from snakewalk.sim.line.clock import SimClock

SAMPLE = PoseSample(
    7, 12.5, np.array([0.1, -0.2, 0.03]), turned((10.0, -20.0, 130.0)), "lab", np.eye(6) * 1e-4
)
ROBOT = load_robot("yaw16")


def test_a_pose_survives_its_datagram() -> None:
    back = decode_pose(encode_pose(SAMPLE))
    assert (back.sequence, back.time_s, back.frame) == (7, 12.5, "lab")
    assert back.position_m == pytest.approx(SAMPLE.position_m)
    assert back.rotation == pytest.approx(SAMPLE.rotation)
    assert back.covariance == pytest.approx(SAMPLE.covariance)


@pytest.mark.parametrize("seed", range(8))
def test_quaternions_and_rotations_are_inverse(seed: int) -> None:
    q = np.random.default_rng(seed).standard_normal(4)
    q *= np.sign(q[0]) / np.linalg.norm(q)
    assert quaternion_of(rotation_of(q.tolist())) == pytest.approx(q.tolist())
    assert quaternion_of(np.diag([-1.0, -1.0, 1.0])) == pytest.approx((0.0, 0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"position_m": [0, 0]}, "position_m: must be 3 numbers"),
        ({"position_m": [0, 0, "x"]}, "position_m: must be 3 numbers"),
        ({"position_m": [0, 0, None]}, "tracker has lost the body"),
        ({"position_m": [0, 0, 10**400]}, "not finite"),
        ({"time_s": float("inf")}, "time_s: not finite"),
        ({"quaternion_wxyz": [0, 0, 0, 0]}, "quaternion of length 0"),
        ({"sequence": -1}, "sequence -1: must be a whole number"),
        ({"sequence": True}, "sequence True"),
        ({"frame": 3}, "frame: must be a name"),
        ({"covariance": [1.0] * 35}, "covariance: must be 36 numbers"),
        ({"covariance": [-1.0] * 36}, "a variance is negative"),
        ({"covariance": list(range(36))}, "must be symmetric"),
        ({"snakewalk_pose": "1"}, "version '1'"),
    ],
)
def test_a_wrong_datagram_is_named(keys: dict[str, object], said: str) -> None:
    row = json.loads(encode_pose(SAMPLE)) | keys
    with pytest.raises(UnusablePoseError, match=said):
        decode_pose(json.dumps(row).encode())


@pytest.mark.parametrize("data", [b"", b"\xff\xfe", b"[]", b"3", b"{}", b"[" * 9000])
def test_no_bytes_end_the_program(data: bytes) -> None:
    with pytest.raises(UnusablePoseError):
        decode_pose(data)


def test_the_offset_of_a_senders_clock_is_that_of_the_quickest_message() -> None:
    clock, rng = SenderClock(), np.random.default_rng(1)
    for time_s in np.arange(0.0, 60.0, 0.02):
        stamp_s = 500.0 + time_s * (1.0 + 80e-6)
        clock.add(stamp_s, time_s + 0.01 + 0.05 * rng.random())
    assert clock.drift == pytest.approx(-80e-6, abs=30e-6)
    stamp_s = 500.0 + 60.0 * (1.0 + 80e-6)
    assert clock.local_s(stamp_s, 60.5) == pytest.approx(60.01, abs=3e-3)


def test_datagrams_of_a_socket_arrive_with_their_sender() -> None:
    feed = UdpFeed("127.0.0.1", 0, WallClock())
    sender = UdpSender("127.0.0.1", feed.port)
    arrived: list[ArrivedPose] = []
    try:
        for _ in range(10_000):  # a lost datagram is sent again
            sender.send(encode_pose(SAMPLE))
            sender.send(b"nonsense")
            arrived += feed.arrived(0.0)
            if len(arrived) >= 2:
                break
        with pytest.raises(InputError, match="cannot be bound"):
            UdpFeed("127.0.0.1", feed.port, WallClock())
    finally:
        sender.close()
        feed.close()
    assert isinstance(arrived[0].sample, PoseSample)
    assert isinstance(arrived[1].sample, UnusablePoseError)
    assert arrived[0].sender.startswith("127.0.0.1:")


def test_addresses() -> None:
    assert parse_address("9870") == ("127.0.0.1", 9870)
    assert parse_address("0.0.0.0:9870") == ("0.0.0.0", 9870)
    assert parse_address("[::1]:9870") == ("::1", 9870)
    for wrong in ("", "host", "host:", "0", "70000", "-1"):
        with pytest.raises(InputError, match="expected PORT or HOST:PORT"):
            parse_address(wrong)


def at(x_m: float, y_m: float, z_m: float, rotation: np.ndarray | None = None) -> PoseSample:
    return PoseSample(
        0, 0.0, np.array([x_m, y_m, z_m]), np.eye(3) if rotation is None else rotation, "lab"
    )


@pytest.mark.parametrize(
    ("sample", "said"),
    [
        (at(-1200.0, 900.0, 30.0), "wrong unit: .* looks like millimetres"),
        (at(3.0, 0.9, 0.03), r"4\.20 m from the start of the run at \(-1\.20, 0\.90\)"),
        (at(-1.2, 0.9, 1.0), r"wrong frame: the link is \+1\.00 m above the ground"),
        (at(-1.2, 0.9, 0.03, turned((90.0, 0.0, 0.0))), "wrong frame: the link's up axis"),
        (at(-1.2, 0.03, -0.9, turned((-90.0, 0.0, 0.0))), r"pose\.world_deg = \[90, 0, 0\]"),
    ],
)
def test_a_first_pose_that_cannot_be_is_named(sample: PoseSample, said: str) -> None:
    fault = start_fault(sample, ROBOT, PoseConfig(), (-1.2, 0.9), lambda x_m, y_m: 0.0)
    assert fault is not None
    assert re.search(said, fault), fault


def test_a_frame_whose_y_axis_is_up_is_turned_by_the_table() -> None:
    config = PoseConfig(world_deg=(90.0, 0.0, 0.0))
    sample = at(-1.2, 0.03, -0.9, turned((-90.0, 0.0, 0.0)))
    assert start_fault(sample, ROBOT, config, (-1.2, 0.9), lambda x_m, y_m: 0.0) is None


def test_millimetres_are_suggested_only_far_away() -> None:
    """A robot half a metre from its start was told that its pose looks like millimetres."""
    fault = start_fault(at(0.0, 0.48, 0.03), ROBOT, PoseConfig(), (0.0, 0.0), lambda x_m, y_m: 0.0)
    assert fault is not None
    assert "0.48 m from the start of the run" in fault


class AtRest:
    """A sender of 50 poses a second with noise of 1 cm and a drift, which may end."""

    def __init__(self, drift_m_s: float, until_s: float = math.inf) -> None:
        self.drift_m_s = drift_m_s
        self.until_s = until_s
        self.rng = np.random.default_rng(2)
        self.sent = 0

    def arrived(self, now_s: float) -> list[ArrivedPose]:
        found = []
        while self.sent <= 50.0 * now_s:
            time_s = self.sent / 50.0
            place_m = [
                self.drift_m_s * min(time_s, self.until_s),
                0.0,
                0.0,
            ] + 0.01 * self.rng.standard_normal(3)
            sample = PoseSample(self.sent, time_s, place_m, np.eye(3), "lab")
            found.append(ArrivedPose(time_s, "10.0.0.1:5000", sample))
            self.sent += 1
        return found


def test_poses_of_a_robot_at_rest_do_not_drift() -> None:
    clock = SimClock()
    (newest,) = await_first_pose("udp:9870", AtRest(0.0), clock, lambda sample: None)
    assert newest.arrival_s == pytest.approx(2.0, abs=0.1)
    with pytest.raises(InputError, match=r"the torque is off, and the pose moves by (1\.[89]|2\.)"):
        await_first_pose("udp:9870", AtRest(0.02), SimClock(), lambda sample: None)


def test_a_limp_body_may_settle_on_rough_ground() -> None:
    settling = AtRest(0.02, until_s=1.9)
    (newest,) = await_first_pose("udp:9870", settling, SimClock(), lambda sample: None)
    assert newest.arrival_s == pytest.approx(4.0, abs=0.1)


class Silence:
    def arrived(self, now_s: float) -> list[ArrivedPose]:
        return []


def test_a_missing_sender_ends_a_run_before_torque() -> None:
    clock = SimClock()
    with pytest.raises(InputError, match="no usable pose within 5 s: nothing arrived; start"):
        await_first_pose("udp:9870", Silence(), clock, lambda sample: None)
    assert clock.now_s() == pytest.approx(WAIT_S, abs=0.1)


def test_a_motion_is_slow_until_the_pose_has_agreed() -> None:
    cautious = [True]
    health = PoseHealth(lambda: None, 2.0, dict, lambda: cautious[0])
    hold = PoseHold(health, lambda level, text: None)
    assert [hold.rate(0.1 * k, 0.1) for k in range(5)] == pytest.approx([0.8, 0.6, 0.5, 0.5, 0.5])
    cautious[0] = False
    assert [hold.rate(0.5 + 0.1 * k, 0.1) for k in range(4)] == pytest.approx([0.7, 0.9, 1.0, 1.0])


def test_a_run_without_a_pose_pauses_and_then_fails() -> None:
    faults, events = ["", "", "stale"], list[str]()
    health = PoseHealth(lambda: faults[-1] or None, 2.0, dict)
    hold = PoseHold(health, lambda level, text: events.append(f"{level}: {text}"))
    rates = [hold.rate(0.1 * k, 0.1) for k in range(10)]
    assert rates[:6] == pytest.approx([0.8, 0.6, 0.4, 0.2, 0.0, 0.0])
    assert hold.is_held
    assert hold.failure is None
    faults.append("")
    assert [hold.rate(1.0, 0.1), hold.rate(1.1, 0.1)] == pytest.approx([0.2, 0.4])
    assert not hold.is_held
    faults.append("jump")
    for k in range(21):
        hold.rate(2.0 + 0.1 * k, 0.1)
    assert hold.failure == "pose: jump"
    assert events == [
        "warning: stale; the motion pauses for up to 2 s",
        "info: the pose is back after 1.0 s",
        "warning: jump; the motion pauses for up to 2 s",
    ]
