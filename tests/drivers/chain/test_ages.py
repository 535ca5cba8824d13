"""Every value has an age, and it counts from when the servo measured."""

from itertools import pairwise

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand, JointState
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ROBOT = RobotConfig(name="four", joint_axes="yyyy")
PERIOD_S = 0.02


def on_line(robot: RobotConfig, baud: int = 1_000_000, **line: float) -> tuple[ServoChain, SimLine]:
    bank = ServoBank(robot.servo_ids, baud=baud)
    sim = SimLine(bank, BenchPlant(robot.joint_count), **line)  # type: ignore[arg-type]
    return ServoChain(DynamixelBus(sim), robot), sim


class LosesSlow:
    """Loses the replies to the slow read from some time on."""

    def __init__(self, line: SimLine) -> None:
        self.lost, self._slow = False, False
        line.tamper = self
        line.taps.append(self._note)

    def _note(self, at_s: float, sent: bool, packet: bytes) -> None:
        if sent:
            self._slow = packet[8:10] == (144).to_bytes(2, "little")

    def __call__(self, reply: bytes) -> list[bytes]:
        return [] if self.lost and self._slow else [reply]


def cycles(chain: ServoChain | SafeLink, line: SimLine, count: int) -> JointState:
    for _ in range(count):
        line.clock.advance(PERIOD_S)
        state = chain.read()
        chain.write(JointCommand(line.clock.now_s(), np.zeros(chain.joint_count)))
    return state


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(("joints", "baud"), [(4, 1_000_000), (60, 57_600)])
@pytest.mark.parametrize("usb_latency_s", [0.0, 0.003])
def test_an_age_counts_from_when_the_servo_measured(
    joints: int, baud: int, usb_latency_s: float
) -> None:
    robot = RobotConfig(name="chain", joint_axes="y" * joints)
    chain, line = on_line(robot, baud, usb_latency_s=usb_latency_s)
    chain.enable()
    cycles(chain, line, 2)
    asked: list[float] = []
    line.taps.append(lambda at_s, sent, packet: asked.append(at_s) if sent else None)
    state = chain.read()
    measured_s = asked[-1]  # a simulated servo measures when the request is complete
    assert state.age_s == pytest.approx(np.full(joints, state.time_s - measured_s), abs=1e-9)
    reply_s = (8 + joints * 14) * 10 / baud
    assert state.age_s == pytest.approx(np.full(joints, reply_s + usb_latency_s), abs=1e-4)


def test_temperature_and_voltage_age_until_they_are_read_again() -> None:
    chain, line = on_line(ROBOT)
    ages = [float(chain.enable().slow_age_s.max())]
    ages += [float(cycles(chain, line, 1).slow_age_s.max()) for _ in range(32)]
    assert min(ages) < 0.002
    assert 15 * PERIOD_S < max(ages) < 17 * PERIOD_S
    assert sum(later < before for before, later in pairwise(ages)) == 2


def test_values_that_do_not_come_any_more_are_not_taken_for_new() -> None:
    chain, line = on_line(ROBOT)
    loses = LosesSlow(line)
    link = SafeLink(chain, SafetyLimits.from_config(ROBOT, SafetyConfig()), line.clock)
    link.enable()
    loses.lost = True
    line.firmware.protection.temperature_c[:] = 76.0
    with pytest.raises(SafetyTrippedError, match=r"temperature and voltage not read for 3\.0\d s"):
        cycles(link, line, 200)
    assert not line.bank["Torque Enable"].any()


def test_one_that_was_lost_is_read_again_when_it_is_overdue() -> None:
    chain, line = on_line(ROBOT)
    loses = LosesSlow(line)
    link = SafeLink(chain, SafetyLimits.from_config(ROBOT, SafetyConfig()), line.clock)
    link.enable()
    loses.lost = True
    cycles(link, line, 100)
    loses.lost = False
    # the first reply has a length that a late one could have; it would else take up to 16 cycles
    assert cycles(link, line, 3).slow_age_s.max() < 3 * PERIOD_S


def test_at_a_slow_rate_the_slow_values_are_no_older_than_a_second() -> None:
    chain, line = on_line(ROBOT)
    chain.enable()
    for _ in range(20):
        line.clock.advance(0.19)  # the watchdog's 0.2 s is the longest pause
        state = chain.read()
        chain.write(JointCommand(line.clock.now_s(), np.zeros(4)))
        assert state.slow_age_s.max() < 1.2
