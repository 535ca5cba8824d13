"""The console of simulated servos: registers, loads, faults and the pace while they run."""

from collections.abc import Callable

import numpy as np
import pytest

from snakewalk.config.faults import FaultPlan
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import BusError
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.console import HELP, Console
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant


@pytest.fixture
def line() -> SimLine:
    return SimLine(ServoBank([1, 2, 7]), BenchPlant(3))


@pytest.fixture
def say(line: SimLine) -> Callable[[str], str]:
    return Console(line, FaultPlayer(line, FaultPlan())).execute


def test_registers_are_set_and_read(line: SimLine, say: Callable[[str], str]) -> None:
    assert say("set 2 homing offset 100") == "Homing Offset = 100 at 1 servo"
    assert DynamixelBus(line).read(2, "Homing Offset") == 100
    assert DynamixelBus(line).read(2, "Present Position") == 2148
    assert say("set 1-2,7 Torque Enable 1") == "Torque Enable = 1 at 3 servos"
    assert line.firmware.drive.torque_on.all()
    assert say("get all Present Position") == "1: 2048  2: 2148  7: 2048"
    assert say("set 7 ID 9") == "ID = 9 at 1 servo"
    assert 9 in DynamixelBus(line).find([7, 9])


def test_a_load_turns_a_limp_shaft(line: SimLine, say: Callable[[str], str]) -> None:
    assert say("load 2 -0.4") == "-0.4 N m on 1 shaft"
    line.clock.sleep_until_s(0.2)
    line.settle()
    assert line.firmware.plant.position_rad[1] < -0.1
    np.testing.assert_allclose(line.firmware.plant.position_rad[[0, 2]], 0.0, atol=1e-9)


def test_a_fault_begins_now_and_others_go_on(line: SimLine, say: Callable[[str], str]) -> None:
    line.clock.sleep_until_s(1.0)
    line.settle()
    assert say("fault mute ids=[7]") == "mute: from now on"
    assert say("fault supply ids=[1] volts=9.0 for_s=2") == "supply: from now on"
    line.clock.sleep_until_s(1.2)
    bus = DynamixelBus(line)
    assert set(bus.find([1, 2, 7])) == {1, 2}
    assert bus.read(1, "Present Input Voltage") == 90
    assert say("fault drop chance=1.0 for_s=0.5") == "drop: from now on"
    with pytest.raises(BusError):
        bus.ping(2)
    line.clock.sleep_until_s(4.0)
    assert bus.read(1, "Present Input Voltage") > 110
    assert set(bus.find([1, 2, 7])) == {1, 2}


def test_the_value_of_a_fault_may_have_spaces(line: SimLine, say: Callable[[str], str]) -> None:
    """Most registers have a space in their name."""
    told = say('fault reading ids=[2, 1] register="Present Temperature" value=0 for_s=5')
    assert told == "reading: from now on"
    line.clock.sleep_until_s(1.0)
    assert DynamixelBus(line).read(2, "Present Temperature") == 0
    assert "write fault KIND" in say('fault reading "Present Temperature" ids=[2]')


def test_the_pace_is_handed_on(line: SimLine) -> None:
    told: list[float] = []
    console = Console(line, FaultPlayer(line, FaultPlan()))
    assert "nobody serves" in console.execute("pace 2")
    console.set_pace = told.append
    assert console.execute("pace 0.5") == "pace 0.5"
    assert told == [0.5]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("set 3 Homing Offset 1", "no servo has ID 3"),
        ("set 1 Colour 1", "Colour: no register of all these servos"),
        ("set 1 Present Position 1", "Present Position: is measured, not set"),
        ("set 1 Torque Enable 900", "Torque Enable"),
        ("set 1", "write set IDS REGISTER VALUE"),
        ("load 1 much", "write load IDS NM"),
        ("fault mute", "ids"),
        ("fault mute ids=[3]", "no servo has ID 3"),
        ("fault mute ids", "write fault KIND"),
        ("dance", "dance: no such command"),
        ("", HELP),
    ],
)
def test_what_cannot_be_done_is_told(say: Callable[[str], str], text: str, said: str) -> None:
    assert said in say(text)
