"""Angles that no servo can have reached since its last reading are not believed."""

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.drivers.protocol.crc import crc16
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.measured_step import MeasuredSteps
from snakewalk.drivers.safety.recovery import Recovery
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.drivers.safety.test_safety_vet import LIMITS, NOW, J, one, state

BEFORE = state(time_s=NOW - 0.02, position_rad=np.full(J, 0.1), current_a=np.full(J, 0.2))
EDGE_RAD = 0.2 + 8.0 * 0.02


@pytest.mark.parametrize("joint", range(J))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_step_beyond_slack_and_speed_counts_as_not_read(joint: int, sign: float) -> None:
    for beyond in (-1e-6, 1e-6):
        step = one(sign * (EDGE_RAD + beyond), joint)
        now = state(position_rad=BEFORE.position_rad + step, current_a=np.full(J, 0.3))
        found, doubt = MeasuredSteps(LIMITS).update(now, BEFORE)
        if beyond < 0:
            assert found is now
            assert doubt is None
            continue
        assert doubt is not None
        assert doubt.startswith(f"{LIMITS.joint_names[joint]}: measured ")
        assert found.valid.tolist() == [k != joint for k in range(J)]
        assert found.position_rad[joint] == 0.1
        assert found.current_a.tolist() == [0.2 if k == joint else 0.3 for k in range(J)]
        assert found.age_s.tolist() == pytest.approx(
            [0.02 if k == joint else 0.0 for k in range(J)]
        )


def test_the_longer_ago_the_last_reading_the_farther_a_joint_may_be() -> None:
    now = state(position_rad=np.full(J, 1.0))
    assert MeasuredSteps(LIMITS).update(now, BEFORE)[1] is not None
    old = BEFORE._replace(age_s=np.full(J, 0.1))
    assert MeasuredSteps(LIMITS).update(now, old)[1] is None


def test_what_was_not_believed_is_not_believed_because_it_is_not_read_again() -> None:
    forged = state(position_rad=one(1.4, 1, 0.1))
    steps = MeasuredSteps(LIMITS)
    held, _ = steps.update(forged, BEFORE)
    unread = forged._replace(time_s=NOW + 0.02, valid=np.arange(J) != 1, age_s=one(0.02, 1))
    unread.position_rad[0] = 0.12
    found, doubt = steps.update(unread, held)
    assert doubt is None
    assert found.position_rad[1] == 0.1
    assert found.position_rad[0] == 0.12
    assert found.valid[0]
    assert found.age_s[1] == pytest.approx(0.04)
    assert not found.valid[1]


def test_what_is_read_again_where_it_cannot_be_stays_in_doubt() -> None:
    """A changed zero was believed as soon as a servo could have turned so far."""
    steps, believed = MeasuredSteps(LIMITS), BEFORE
    for k in range(20):
        now = state(time_s=NOW + 0.02 * k, position_rad=one(0.5 + 0.002 * k, 1, 0.1))
        believed, doubt = steps.update(now, believed)
        assert doubt is not None
        assert believed.position_rad[1] == 0.1
    assert believed.age_s[1] == pytest.approx(0.4)
    back = state(time_s=NOW + 0.4, position_rad=np.full(J, 0.12))
    assert steps.update(back, believed) == (back, None)


@pytest.mark.parametrize("all_read", [True, False])
def test_a_step_has_the_time_from_when_the_one_was_measured_to_when_the_other_was(
    *, all_read: bool
) -> None:
    valid = np.array([True, True, all_read])
    late = state(position_rad=one(0.4, 0, 0.1), age_s=one(0.01, 0), valid=valid)
    assert MeasuredSteps(LIMITS).update(late, BEFORE)[1] is not None  # 0.3 rad in 0.01 s
    old = BEFORE._replace(age_s=one(0.02, 0))
    now = state(position_rad=one(0.55, 0, 0.1), valid=valid)
    assert MeasuredSteps(LIMITS).update(now, old)[1] is None  # 0.45 rad in 0.04 s


AT_ZERO = BEFORE._replace(position_rad=np.zeros(J))
NOT_ALL = np.arange(J) != J - 1


def test_a_joint_that_is_not_read_keeps_what_was_believed() -> None:
    before = BEFORE._replace(valid=NOT_ALL)
    unread = state(position_rad=one(0.15, J - 1, 0.1), valid=NOT_ALL)
    found, doubt = MeasuredSteps(LIMITS).update(unread, before)
    assert doubt is None
    assert found.position_rad[J - 1] == 0.1


@pytest.mark.parametrize("step_rad", [0.19, 0.2])
def test_a_reading_from_before_the_last_one_has_the_slack_alone(step_rad: float) -> None:
    older = state(position_rad=one(step_rad, 0), age_s=one(0.05, 0), valid=NOT_ALL)
    assert MeasuredSteps(LIMITS).update(older, AT_ZERO)[1] is None
    farther = older._replace(position_rad=one(step_rad + 0.02, 0))
    assert MeasuredSteps(LIMITS).update(farther, AT_ZERO)[1] is not None


def test_a_doubt_of_one_joint_is_no_doubt_of_another_that_moves_quickly() -> None:
    steps = MeasuredSteps(LIMITS)
    held, _ = steps.update(state(position_rad=one(0.5, 1)), AT_ZERO)
    later = state(time_s=NOW + 0.02, position_rad=one(0.25, 0))
    assert steps.update(later, held)[1] is None


def test_a_doubt_lasts_within_the_slack_about_it_and_beyond_the_slack_of_what_was_believed() -> (
    None
):
    """Both edges count as the slack's."""
    for believed_rad, doubted_rad, again_rad, lasts in (
        (-0.25, 0.2, 0.0, True),
        (0.0, 0.375, 0.2, False),
    ):
        before, steps = (
            BEFORE._replace(position_rad=np.full(J, believed_rad)),
            MeasuredSteps(LIMITS),
        )
        held, doubt = steps.update(state(position_rad=one(doubted_rad, 1, believed_rad)), before)
        assert doubt is not None
        later = state(time_s=NOW + 0.1, position_rad=one(again_rad, 1, believed_rad))
        assert (steps.update(later, held)[1] is not None) == lasts


def test_a_reset_forgets_what_was_doubted() -> None:
    steps = MeasuredSteps(LIMITS)
    held, _ = steps.update(state(position_rad=one(0.5, 1, 0.1)), BEFORE)
    steps.reset()
    now = state(time_s=NOW + 0.2, position_rad=one(0.5, 1, 0.1))
    assert steps.update(now, held) == (now, None)


def test_what_is_held_is_read_only() -> None:
    held, _ = MeasuredSteps(LIMITS).update(state(position_rad=one(1.4, 1, 0.1)), BEFORE)
    for array in (held.position_rad, held.velocity_rad_s, held.current_a, held.age_s, held.valid):
        assert not array.flags.writeable


def test_what_is_no_number_is_left_to_the_vetting() -> None:
    now = state(position_rad=one(np.nan, 2, 0.1))
    assert MeasuredSteps(LIMITS).update(now, BEFORE) == (now, None)


ROBOT = RobotConfig(name="trio", joint_axes="yyy")


class Forger:
    """Gives one joint another angle, with a right checksum, in every reply until ``left`` is 0."""

    def __init__(self, left: int) -> None:
        self.left = left

    def __call__(self, reply: bytes) -> list[bytes]:
        ten_bytes_each = 8 + 3 * 14
        if len(reply) != ten_bytes_each or not self.left:
            return [reply]
        self.left -= 1
        raw = bytearray(reply)
        at = 8 + 14 + 2 + 6  # head; first servo; error and ID of the second; current, velocity
        raw[at : at + 4] = (2048 - 700).to_bytes(4, "little")
        for end in range(8 + 14, ten_bytes_each + 1, 14):
            raw[end - 2 : end] = crc16(bytes(raw[: end - 2])).to_bytes(2, "little")
        return [bytes(raw)]


def run(forged: int) -> tuple[SafeLink, float, int]:
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(3))
    clock = line.clock
    chain = ServoChain(DynamixelBus(line), ROBOT)
    limits = SafetyLimits.from_config(ROBOT, SafetyConfig())
    link = SafeLink(chain, limits, clock, Recovery(chain, policy="resume"))
    link.enable()
    forger = Forger(forged)
    line.tamper = forger
    step, last = 0.0, np.zeros(3)
    for _ in range(30):
        next_s = clock.now_s() + 0.02
        try:
            state_now = link.read()
            assert state_now.position_rad[1] == pytest.approx(0.0, abs=0.02)
            link.write(JointCommand(clock.now_s(), np.zeros(3)))
        except SafetyTrippedError:
            break
        goal = link.last_verdict.goal_rad if link.last_verdict else last
        step, last = max(step, float(np.abs(goal - last).max())), goal
        clock.sleep_until_s(next_s)
    return link, step, forger.left


def test_one_forged_answer_moves_nothing_and_stops_nothing() -> None:
    link, step, left = run(1)
    assert left == 0
    assert link.tripped is None
    assert step < 0.01


def test_an_angle_that_stays_unbelievable_stops_the_run_for_good() -> None:
    link, step, _ = run(1000)
    assert link.tripped is not None
    assert "joint yaw_02 (ID 2): measured -1.07 rad" in link.tripped
    assert "exchanged IDs" in link.tripped
    assert link.recoveries == 0
    assert step < 0.01


def test_impossible_angles_that_come_and_go_are_reported_twice() -> None:
    """A sensor that jumped by a turn in every seventh read gave hundreds of lines."""
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(3))
    chain, events = ServoChain(DynamixelBus(line), ROBOT), list[str]()
    limits = SafetyLimits.from_config(ROBOT, SafetyConfig())
    link = SafeLink(chain, limits, line.clock, on_event=events.append)
    link.enable()
    line.tamper = forger = Forger(0)
    for k in range(60):
        forger.left = 1 if k % 3 == 0 else 0
        next_s = line.clock.now_s() + 0.02
        link.read()
        link.write(JointCommand(line.clock.now_s(), np.zeros(3)))
        line.clock.sleep_until_s(next_s)
    assert len(events) == 2
    assert "10 times so far; later ones are not reported" in events[1]
