"""The serial port on a pseudo terminal; the other end is the test."""

import errno
import fcntl
import os
import struct
import subprocess
import sys
import termios
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from snakewalk.config.errors import InputError
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.serial_port import SerialPort, open_fault
from snakewalk.sim.line.clock import SimClock


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


def test_bytes_that_another_program_was_quicker_to_read_do_not_end_the_port(
    pair: tuple[int, SerialPort], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was told as a port that is gone, and a run did not wait for torque off to be confirmed."""
    master, port = pair
    os.write(master, b"abcd")
    read, taken = os.read, iter([b"ab"])

    def beaten(descriptor: int, count: int) -> bytes:
        for mine in taken:  # the other program's read, between our poll and ours
            assert read(descriptor, 2) == mine
            raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")
        return read(descriptor, count)

    monkeypatch.setattr(os, "read", beaten)
    assert port.read_until(2, port.clock.now_s() + 5.0) == b"cd"


def test_draining_and_clearing_throw_away(pair: tuple[int, SerialPort]) -> None:
    master, port = pair
    os.write(master, b"late reply")
    assert port.drain_until_quiet(0.01) == len(b"late reply")
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
        port.setPacketTimeoutMillis(0.0)  # a read waits until the time-out, and no longer
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
    with pytest.raises(PortError, match="is not a serial device"):
        SerialPort(path)
    with pytest.raises(PortError, match="is not a serial device"):
        SerialPort("/dev/null")


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


@pytest.mark.parametrize("call", ["write", "read", "transact", "clear", "waiting"])
def test_a_port_that_vanishes_is_a_port_error(call: str) -> None:
    master, slave = os.openpty()
    port = SerialPort(os.ttyname(slave), 57_600)
    os.close(slave)
    os.close(master)
    calls = {
        "write": lambda: port.write(b"x"),
        "read": lambda: port.read_until(1, 0.0),
        "transact": lambda: transact(port, b"x", 1, 1.0),
        "clear": port.clearPort,
        "waiting": port.getBytesAvailable,
    }
    port.is_using = True
    with pytest.raises(PortError, match="the port is gone"):
        calls[call]()
    assert not port.is_using
    port.closePort()


def transact(port: SerialPort, request: bytes, count: int, wait_s: float) -> bytes:
    """Request and reply, as ``ControlCycle`` does it where nothing is compiled."""
    port.clearPort()
    port.write(request)
    return port.read_until(count, port.clock.now_s() + wait_s)


def servo(master: int, request: bytes, *replies: bytes) -> threading.Thread:
    """Replies piece by piece once the whole request is there."""

    def serve() -> None:
        received = b""
        while len(received) < len(request):
            received += os.read(master, 4096)
        for reply in replies if received == request else ():
            os.write(master, reply)

    thread = threading.Thread(target=serve)
    thread.start()
    return thread


def test_a_transaction_discards_what_arrived_before_it(pair: tuple[int, SerialPort]) -> None:
    master, port = pair
    os.write(master, b"an older reply")
    thread = servo(master, b"request", b"a" * 100, b"b" * 64, b"c" * 64, b"d" * 72)
    whole = b"a" * 100 + b"b" * 64 + b"c" * 64 + b"d" * 72
    assert transact(port, b"request", 300, 5.0) == whole
    thread.join()


def test_a_transaction_ends_at_its_deadline_with_what_arrived(pair: tuple[int, SerialPort]) -> None:
    master, port = pair
    thread = servo(master, b"request", b"short")
    now = port.clock.now_s()
    assert transact(port, b"request", 300, 0.2) == b"short"
    assert port.clock.now_s() >= now + 0.2
    thread.join()


def test_a_transaction_takes_no_more_than_requested(pair: tuple[int, SerialPort]) -> None:
    master, port = pair
    thread = servo(master, b"request", b"answer and more")
    assert transact(port, b"request", 6, 5.0) == b"answer"
    assert port.read_until(9, port.clock.now_s() + 5.0) == b" and more"
    thread.join()


def test_a_request_longer_than_the_devices_buffer(pair: tuple[int, SerialPort]) -> None:
    master, port = pair
    request = bytes(range(256)) * 80
    thread = servo(master, request, b"answer")
    assert transact(port, request, 6, 5.0) == b"answer"
    thread.join()


def test_no_latency_timer_on_a_pseudo_terminal(pair: tuple[int, SerialPort]) -> None:
    assert pair[1].latency_timer_ms is None


def test_a_device_that_is_gone_is_a_port_error_whatever_the_terminal_raises(
    pair: tuple[int, SerialPort], monkeypatch: pytest.MonkeyPatch
) -> None:
    """``termios.error`` is no ``OSError``, and left ``clearPort``'s neighbours as it was."""

    def gone(*_: object) -> None:
        raise termios.error(5, "Input/output error")

    _, port = pair
    device = port._line
    monkeypatch.setattr(type(device), "in_waiting", property(gone))
    monkeypatch.setattr(type(device), "reset_input_buffer", gone)
    monkeypatch.setattr(type(device), "close", gone)
    with pytest.raises(PortError, match="the port is gone"):
        port.getBytesAvailable()
    with pytest.raises(PortError, match="the port is gone"):
        port.clearPort()
    port.closePort()


_TIOCGEXCL = 0x80045440
"""ioctl_tty(2): whether a terminal is in exclusive mode."""


def exclusive(descriptor: int) -> bool:
    flag = fcntl.ioctl(descriptor, _TIOCGEXCL, struct.pack("i", 0))
    return bool(struct.unpack("i", flag)[0])


class Adapter(SerialPort):
    """A pseudo-terminal that is taken for an adapter."""

    def _is_pseudo_terminal(self) -> bool:
        return False


def test_a_device_is_taken_exclusively_and_given_back() -> None:
    master, slave = os.openpty()
    with Adapter(os.ttyname(slave), 57_600):
        assert exclusive(slave)
    assert not exclusive(slave)
    os.close(master)
    os.close(slave)


def test_a_pseudo_terminal_keeps_no_flag_that_a_killed_program_would_leave() -> None:
    master, slave = os.openpty()
    with SerialPort(os.ttyname(slave), 57_600):
        assert not exclusive(slave)
    os.close(master)
    os.close(slave)


def test_who_has_the_port_open_is_named(pair: tuple[int, SerialPort]) -> None:
    name = pair[1].name
    with open("/proc/self/comm", encoding="utf-8") as file:
        own = file.read().strip()
    with pytest.raises(PortError) as caught:
        SerialPort(name, 57_600)
    assert str(caught.value).startswith(f"{name}: another program has it open: ")
    assert own in str(caught.value)
    assert f" (process {os.getpid()})" in str(caught.value)


@pytest.mark.parametrize(
    ("before", "shown"),
    [(["-X", "utf8", "-u"], "snakewalk_probe.py"), (["-m"], "-m snakewalk_probe")],
)
def test_a_python_program_that_has_the_port_open_is_named_with_its_script(
    pair: tuple[int, SerialPort], tmp_path: Path, before: list[str], shown: str
) -> None:
    name = pair[1].name
    script = tmp_path / "snakewalk_probe.py"
    script.write_text(
        "import os, sys, time\n"
        "os.open(sys.argv[-1], os.O_RDWR)\nprint(flush=True)\ntime.sleep(99)\n"
    )
    target = script.stem if "-m" in before else str(script)
    words = [sys.executable, *before, target, name]
    with subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            process.stdout.readline()
            text = open_fault(name, 57_600, OSError(errno.EBUSY, "busy"))
        finally:
            process.kill()
    assert f"{shown} (process {process.pid})" in text
    assert text.endswith("; close it"), "it is no command of snakewalk"


def test_a_command_of_snakewalk_that_has_the_port_open_is_named_with_its_run(
    pair: tuple[int, SerialPort],
) -> None:
    name = pair[1].name
    program = (
        "import os, sys, time; os.open(sys.argv[-1], os.O_RDWR); print(flush=True); time.sleep(99)"
    )
    words = ["snakewalk", "-c", program, "run", "flat-square", name]
    with subprocess.Popen(words, executable=sys.executable, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            process.stdout.readline()
            text = open_fault(name, 57_600, OSError(errno.EBUSY, "busy"))
        finally:
            process.kill()
    assert f"run flat-square {name} (process {process.pid})" in text
    assert text.endswith(f"; end it, a run by: snakewalk stop --port {name}")


@pytest.mark.parametrize(("timer_ms", "latency_s"), [(16, 0.019), (1, 0.004), (None, 0.004)])
def test_the_host_delays_bytes_by_the_adapters_timer_and_its_own_3_ms(
    timer_ms: int | None, latency_s: float
) -> None:
    class Timed(Adapter):
        latency_timer_ms = timer_ms  # type: ignore[assignment]

    assert Timed.__new__(Timed).latency_s == pytest.approx(latency_s)


def test_another_fault_of_a_terminal_is_told_as_it_is_and_nothing_stays_open() -> None:
    master, slave = os.openpty()
    name, error = os.ttyname(slave), OSError(errno.EIO, "broken")
    before = sorted(os.listdir("/proc/self/fd"))
    assert open_fault(name, 57_600, error) == f"{name}: cannot be opened: {error}"
    assert sorted(os.listdir("/proc/self/fd")) == before
    os.close(master)
    os.close(slave)
