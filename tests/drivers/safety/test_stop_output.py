"""The stop output: activated once if torque off is not confirmed, and never otherwise."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from pytest_mock import MockerFixture

from snakewalk.config.loader import checked
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import BusError, PortError, SafetyTrippedError
from snakewalk.drivers.safety import stop_output
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.safety.stop_output import (
    StopCall,
    StopCommand,
    StopLine,
    parse_stop_output,
)
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ROBOT = RobotConfig(name="some", joint_axes="yyyy")


class Rig:
    """Simulated servos whose supply the stop output opens."""

    def __init__(self, *, fails: bool = False) -> None:
        self.line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(4))
        self.events: list[str] = []
        self.calls = 0
        self.fails = fails
        self.link = SafeLink(
            ServoChain(DynamixelBus(self.line), ROBOT),
            SafetyLimits.from_config(ROBOT, SafetyConfig()),
            self.line.clock,
            on_event=self.events.append,
            stop_output=StopCall("simulated supply", self.open_supply),
        )

    def open_supply(self) -> None:
        self.calls += 1
        if self.fails:
            raise OSError("relay is gone")
        self.line.firmware.cut_power(np.arange(4))

    def run(self, *, stop: bool = False, reads: int = 0) -> None:
        """Enable, let a servo fall silent, stop, read on, and end."""
        with self.link:
            self.link.enable()
            self.silence()
            if stop:
                self.link.request_stop("operator")
            for _ in range(reads):
                self.link.read()

    def silence(self) -> None:
        self.line.mute(np.array([2]), True)
        self.line.refresh_ids()


def test_a_torque_off_that_is_confirmed_activates_nothing() -> None:
    rig = Rig()
    with rig.link:
        rig.link.enable()
        rig.link.request_stop("operator")
        rig.link.read()
    assert rig.calls == 0


def test_a_link_that_was_never_enabled_activates_nothing() -> None:
    rig = Rig()
    rig.silence()
    with pytest.raises(BusError):
        rig.link.disable()
    assert rig.calls == 0


def test_a_torque_off_that_is_not_confirmed_opens_the_supply_once() -> None:
    rig = Rig()
    with pytest.raises(BusError, match="torque off is not confirmed") as raised:
        rig.run()
    assert rig.calls == 1
    assert not rig.line.firmware.powered.any()
    line = "stop output simulated supply: activated, because torque off is not confirmed"
    assert line in raised.value.__notes__
    assert rig.events == [line]


def test_a_trip_activates_it_and_the_exit_does_not_again() -> None:
    rig = Rig()
    with pytest.raises(BusError):
        rig.run(stop=True, reads=1)
    assert rig.calls == 1
    with pytest.raises(SafetyTrippedError):
        rig.link.enable()


def test_an_output_that_fails_is_reported_and_tried_again() -> None:
    rig = Rig(fails=True)
    with pytest.raises(BusError) as raised:
        rig.run(stop=True, reads=2)
    assert rig.calls == 3
    line = "stop output simulated supply: relay is gone; switch the servo power off"
    assert line in raised.value.__notes__
    assert rig.link.tripped is not None
    assert rig.link.tripped.startswith("operator (torque off failed: ")


class FakeSerial:
    """Modem lines of a port."""

    def __init__(self) -> None:
        self.port, self.rts, self.dtr, self.is_open = "", True, True, False
        self.at_open: tuple[bool, bool] | None = None

    def open(self) -> None:
        self.is_open, self.at_open = True, (self.rts, self.dtr)

    def close(self) -> None:
        self.is_open = False


@pytest.mark.parametrize("line", ["rts", "dtr"])
@pytest.mark.parametrize("sign", ["", "-"])
def test_a_line_is_inactive_until_it_is_activated(
    line: str, sign: str, mocker: MockerFixture
) -> None:
    port = FakeSerial()
    mocker.patch.object(stop_output.serial, "Serial", return_value=port)
    output = parse_stop_output(f"{sign}{line}:/dev/ttyUSB7")
    idle = sign == "-"
    with output:
        assert port.at_open == (idle, idle)
        assert (port.port, getattr(port, line)) == ("/dev/ttyUSB7", idle)
        output.activate()
        assert getattr(port, line) is not idle
    assert not port.is_open
    with pytest.raises(OSError, match="the port is closed"):
        output.activate()


def test_a_port_without_the_line_is_rejected_before_the_run() -> None:
    master, slave = os.openpty()
    try:
        with pytest.raises(PortError, match=r"^stop output rts:.*name a serial port"):
            StopLine(os.ttyname(slave), "rts", is_inverted=False).__enter__()
    finally:
        os.close(master)
        os.close(slave)


def test_a_command_runs_without_a_shell(tmp_path: Path) -> None:
    target = tmp_path / "$HOME; touch x"
    code = "import pathlib, sys; pathlib.Path(sys.argv[1]).touch()"
    with StopCommand((sys.executable, "-c", code, str(target))) as output:
        output.activate()
    assert [each.name for each in tmp_path.iterdir()] == ["$HOME; touch x"]


def test_a_command_that_fails_hangs_or_is_missing_is_an_error(mocker: MockerFixture) -> None:
    with pytest.raises(OSError, match="exit code 3"):
        StopCommand((sys.executable, "-c", "raise SystemExit(3)")).activate()
    with pytest.raises(OSError, match="nowhere"):
        StopCommand(("/nowhere/stop",)).activate()
    mocker.patch.object(stop_output, "PATIENCE_S", 0.01)
    with pytest.raises(OSError, match="has not ended"):
        StopCommand((sys.executable, "-c", "input(); import time; time.sleep(9)")).activate()


@pytest.mark.parametrize(
    "text", ["rts", "rts:", "cts:/dev/x", "command:", "command:relay off", "--rts:/dev/x", ""]
)
def test_other_texts_are_rejected(text: str) -> None:
    with pytest.raises(ValueError, match=r"absolute path|not a stop output"):
        parse_stop_output(text)
    with pytest.raises(Exception, match="stop_output"):
        checked(SafetyConfig, {"stop_output": text}, "test")


def test_a_command_keeps_its_quoted_words() -> None:
    output = parse_stop_output("command:/opt/relay 'all off' 1")
    assert isinstance(output, StopCommand)
    assert output.words == ("/opt/relay", "all off", "1")
    assert output.name == "/opt/relay 'all off' 1"
