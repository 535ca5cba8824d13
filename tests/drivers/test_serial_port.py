"""The serial port on a pseudo terminal; the other end is the test."""

import os
from collections.abc import Iterator

import pytest
import serial

from config.errors import InputError
from drivers.errors import PortError
from drivers.serial_port import SerialPort
from sim.bus.clock import SimClock


@pytest.fixture
def pair() -> Iterator[tuple[int, SerialPort]]:
    master, slave = os.openpty()
    with SerialPort(os.ttyname(slave), 57_600) as port:
        yield master, port
    os.close(master)
    os.close(slave)


def test_bytes_go_both_ways(pair: tuple[int, SerialPort]) -> None:
    master, port = pair
    port.write(b"\xff\xff\xfd\x00")
    assert os.read(master, 10) == b"\xff\xff\xfd\x00"
    os.write(master, b"abcdef")
    far = port.clock.now_s() + 5.0
    assert port.read_until(4, far) == b"abcd"
    assert port.getBytesAvailable() == 2
    assert port.readPort(10) == b"ef"


def test_a_deadline_returns_what_came(pair: tuple[int, SerialPort]) -> None:
    master, port = pair
    os.write(master, b"ab")
    now = port.clock.now_s()
    assert port.read_until(4, now + 0.01) == b"ab"
    assert port.clock.now_s() >= now + 0.01
    assert port.read_until(4, now) == b""


def test_draining_and_clearing_throw_away(pair: tuple[int, SerialPort]) -> None:
    master, port = pair
    os.write(master, b"late answer")
    assert port.drain_until_quiet(0.01) == len(b"late answer")
    os.write(master, b"more")
    port.clearPort()
    assert port.read_until(1, port.clock.now_s()) == b""


def test_the_sdks_timeout_runs_on_the_ports_clock() -> None:
    master, slave = os.openpty()
    clock = SimClock()
    with SerialPort(os.ttyname(slave), 57_600, clock) as port:
        port.setPacketTimeout(11)  # 11 bytes, two latency timers of 16 ms, 2 ms
        clock.sleep_until_s(11 * 10 / 57_600 + 0.0339)
        assert not port.isPacketTimeout()
        clock.sleep_until_s(11 * 10 / 57_600 + 0.0341)
        assert port.isPacketTimeout()
    os.close(master)
    os.close(slave)


def test_baud_rates(pair: tuple[int, SerialPort]) -> None:
    port = pair[1]
    assert port.setBaudRate(1_000_000)
    assert port.getBaudRate() == 1_000_000
    assert not port.setBaudRate(-1)
    assert port.getBaudRate() == 1_000_000


def test_a_port_that_is_not_there_is_an_input_error() -> None:
    with pytest.raises(InputError, match="/dev/ttyNOPE: no such port; there is"):
        SerialPort("/dev/ttyNOPE")


def test_a_file_is_no_port(tmp_path: os.PathLike[str]) -> None:
    path = os.path.join(tmp_path, "file")
    open(path, "w").close()
    with pytest.raises(PortError, match="cannot be opened"):
        SerialPort(path)


def test_a_port_is_opened_for_one_program_alone(pair: tuple[int, SerialPort]) -> None:
    with pytest.raises(PortError, match="another program has it open"):
        SerialPort(pair[1].name)


def test_a_closed_port_says_so(pair: tuple[int, SerialPort]) -> None:
    port = pair[1]
    port.closePort()
    port.closePort()
    with pytest.raises(PortError, match="is closed"):
        port.write(b"x")
    assert port.openPort()
    port.write(b"x")


@pytest.mark.parametrize("call", ["write", "read", "clear", "waiting"])
def test_a_port_that_vanishes_is_a_port_error(
    pair: tuple[int, SerialPort], monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    def gone(*_: object) -> None:
        raise serial.SerialException("device reports readiness but returned no data")

    port = pair[1]
    for name in ("write", "read", "reset_input_buffer"):
        monkeypatch.setattr(serial.Serial, name, gone)
    monkeypatch.setattr(serial.Serial, "in_waiting", property(gone))
    calls = {
        "write": lambda: port.write(b"x"),
        "read": lambda: port.read_until(1, 0.0),
        "clear": port.clearPort,
        "waiting": port.getBytesAvailable,
    }
    port.is_using = True
    with pytest.raises(PortError, match="the port is gone"):
        calls[call]()
    assert not port.is_using


def test_no_latency_timer_on_a_pseudo_terminal(pair: tuple[int, SerialPort]) -> None:
    assert pair[1].latency_timer_ms is None
