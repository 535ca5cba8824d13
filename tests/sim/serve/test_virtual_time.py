"""A served bus in virtual time: its clock is that of the client, whatever both processes do."""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

import numpy as np
import pytest
import serial

from snakewalk.config.loader import with_keys
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.pose.sample import PoseSample
from snakewalk.controller.pose.udp_feed import SimulatedDatagrams
from snakewalk.controller.run.backend import bus_on_ports, is_pseudo_terminal
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.byte_port import reopen
from snakewalk.drivers.port.network_port import open_port
from snakewalk.drivers.port.served_line import ServedLine
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.serve.servo_bus import ServoBus
from snakewalk.sim.serve.virtual_time import VirtualTimeServer
from tests.helpers.command import snakewalk

PROGRAM = "from snakewalk.controller.cli.main import main; main()"
ROBOT = RobotConfig(name="four", joint_axes="yyyy")
PERIOD_S = 0.02


@contextmanager
def served(
    *datagrams: tuple[float, bytes], held: threading.Event | None = None
) -> Iterator[tuple[VirtualTimeServer, ServoBus]]:
    """Serve four servos in a thread; after 5 s a reply waits until it is not ``held``."""
    bus = ServoBus("1-4")
    waiting = list(datagrams)

    def due(now_s: float) -> Sequence[tuple[float, bytes]]:
        if held is not None and now_s > 5.0:
            held.wait()
        ripe = [each for each in waiting if each[0] <= now_s]
        waiting[:] = [each for each in waiting if each[0] > now_s]
        return ripe

    ended = threading.Event()
    with VirtualTimeServer(bus.line, due) as server:
        thread = threading.Thread(target=server.serve, args=(ended.is_set,))
        thread.start()
        try:
            yield server, bus
        finally:
            ended.set()
            thread.join()
            bus.close()


def swing(link: SafeLink, clock: ServedLine, cycles: int) -> list[list[float]]:
    """Swing the joints; return time and positions of each cycle."""
    rows = []
    next_s = clock.now_s()
    for number in range(cycles):
        clock.sleep_until_s(next_s)
        state = link.read()
        rows.append([clock.now_s(), *state.position_rad, *state.velocity_rad_s])
        goal_rad = 0.3 * np.sin(4.0 * PERIOD_S * number + np.arange(4)) - 0.3 * np.sin(np.arange(4))
        link.write(JointCommand(clock.now_s(), goal_rad))
        next_s += PERIOD_S
    return rows


def opened(line: ServedLine) -> SafeLink:
    """Return the link of the four servos."""
    chain = ServoChain(DynamixelBus(line, ROBOT.models_by_id), ROBOT, watchdog_s=0.2)
    return SafeLink(chain, SafetyLimits.from_config(ROBOT, SafetyConfig()), line)


def test_time_passes_only_while_the_client_waits() -> None:
    with served() as (server, bus), ServedLine(server.path) as line:
        begin_s = line.now_s()
        assert DynamixelBus(line).ping(3).servo_id == 3
        asked_s = line.now_s()
        assert 0.0 < asked_s - begin_s < 0.01
        line.sleep_until_s(asked_s + 3600.0)
        assert line.now_s() == bus.line.clock.now_s() == asked_s + 3600.0
        line.sleep_until_s(5.0)
        assert line.now_s() == asked_s + 3600.0


def test_a_chain_swings_as_on_a_wire() -> None:
    with served() as (server, bus), ServedLine(server.path) as line, opened(line) as link:
        link.enable()
        rows = np.array(swing(link, line, 100))
        assert np.ptp(rows[:, 1:5], axis=0).min() > 0.3
        assert np.diff(rows[:, 0]).max() < PERIOD_S + 0.01
        line.sleep_until_s(line.now_s() + 1.0)  # no packets: the watchdog stops the servos
        assert bus["Bus Watchdog"].tolist() == [255] * 4


def test_a_second_client_is_rejected_and_the_line_is_free_after_the_first() -> None:
    with served() as (server, _):
        with (
            ServedLine(server.path),
            pytest.raises(PortError, match=r"the port is gone.* whose line has one client"),
        ):
            ServedLine(server.path)
        with ServedLine(server.path) as line:
            assert DynamixelBus(line).ping(1).servo_id == 1


def test_bytes_of_a_stranger_end_only_his_connection() -> None:
    import socket
    from urllib.parse import urlsplit

    with served() as (server, _):
        url = urlsplit(server.path)
        for text in (b"GET / HTTP/1.1\r\n\r\n", b"[1]\n", b'["nosuch"]\n', b'["write", 3]\n'):
            with socket.create_connection((url.hostname, url.port)) as stranger:
                stranger.sendall(text)
                stranger.shutdown(socket.SHUT_WR)
                while stranger.recv(100):
                    pass
        with ServedLine(server.path) as line:
            assert DynamixelBus(line).ping(2).servo_id == 2


def test_a_server_that_ends_is_a_lost_port_and_time_goes_on() -> None:
    with served() as (server, _):
        line = ServedLine(server.path)
    with pytest.raises(PortError, match="the port is gone"):
        DynamixelBus(line).ping(1)
    now_s = line.now_s()
    line.sleep_until_s(now_s + 1.0)
    assert line.now_s() == now_s + 1.0
    with pytest.raises(PortError, match="start snakewalk bus serve --virtual-time"):
        line.openPort()


def test_a_port_that_vanishes_is_opened_again_when_it_is_back() -> None:
    with served() as (server, bus), ServedLine(server.path) as line:
        bus.fault("port", for_s=0.5)
        line.sleep_until_s(line.now_s() + 0.1)
        with pytest.raises(PortError, match="the port has vanished"):
            line.write(b"\xff")
        with pytest.raises(PortError, match="the port has vanished"):
            reopen(line)
        line.sleep_until_s(line.now_s() + 1.0)  # its own clock, without a line
        reopen(line)
        assert DynamixelBus(line).ping(4).servo_id == 4
        assert bus.line.clock.now_s() == line.now_s() > 1.1


def test_a_call_that_a_signal_interrupts_does_not_shift_the_replies() -> None:
    held = threading.Event()

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        with served(held=held) as (server, _), ServedLine(server.path) as line:
            signal.setitimer(signal.ITIMER_REAL, 0.01)
            with pytest.raises(KeyboardInterrupt):
                line.sleep_until_s(6.0)
            held.set()
            line.sleep_until_s(7.0)
            assert line.now_s() == 7.0
            assert line.getBytesAvailable() == 0
    finally:
        signal.signal(signal.SIGALRM, before)


def test_pyserial_opens_it_too() -> None:
    with served() as (server, _):
        port = serial.serial_for_url(server.path, 1_000_000, timeout=0.05)
        ping = bytes.fromhex("fffffd000103000119 4e")
        port.write(ping)
        assert port.read(14)[4] == 1
        with pytest.raises(serial.SerialException, match="whose line has one client"):
            serial.serial_for_url(server.path)
        port.close()
        with serial.serial_for_url(server.path) as again:
            assert again.is_open
        assert not again.is_open


def test_datagrams_come_with_the_time() -> None:
    sent = (1.0, b"first"), (2.0, b"second")
    with served(*sent) as (server, _), ServedLine(server.path) as line:
        feed = SimulatedDatagrams(line.due)
        assert not feed.arrived(line.now_s())
        line.sleep_until_s(1.5)
        (arrived,) = feed.arrived(line.now_s())
        assert arrived.arrival_s == 1.0
        assert not isinstance(arrived.sample, PoseSample)
        line.sleep_until_s(3.0)
        assert [each.arrival_s for each in feed.arrived(3.0)] == [2.0]


def test_one_port_of_a_chain_cannot_have_virtual_time() -> None:
    with served() as (server, _):
        assert is_pseudo_terminal([server.path])
        with pytest.raises(PortError, match="ports of one chain cannot share"):
            open_port(server.path, clock=WallClock())
        ports = [{"port": server.path, "ids": (1, 2)}, {"port": "loop://", "ids": (3, 4)}]
        robot = with_keys(ROBOT, {"ports": ports}, "test")
        with pytest.raises(PortError, match="cannot share"):
            bus_on_ports(robot, WallClock())


@pytest.mark.parametrize("word", ["--link=tty", "--pace=2"])
def test_virtual_time_has_no_device_and_no_pace(word: str) -> None:
    ended = snakewalk("bus", "serve", "--virtual-time", word)
    assert ended.returncode == 2
    assert "has no device and no pace" in ended.stderr


@contextmanager
def program(*words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Serve by the command, in another process; yield it and its port."""
    command = [sys.executable, "-c", PROGRAM, "bus", "serve", "--virtual-time", "--json", *words]
    with subprocess.Popen(command, text=True, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        try:
            yield process, json.loads(process.stdout.readline())["port"]
        finally:
            with suppress(ProcessLookupError):
                process.kill()


@pytest.mark.slow
def test_a_server_that_stands_still_for_two_seconds_changes_nothing() -> None:
    """On a pseudo-terminal the chain trips after 0.1 s."""
    results = []
    for is_stopped in (False, True):
        with program("--servos", "1-4") as (process, port), ServedLine(port) as line:
            with opened(line) as link:
                link.enable()
                rows = swing(link, line, 50)
                if is_stopped:
                    os.kill(process.pid, signal.SIGSTOP)
                    threading.Timer(2.0, os.kill, (process.pid, signal.SIGCONT)).start()
                rows += swing(link, line, 50)
                assert link.tripped is None
            results.append(rows)
    assert results[0] == results[1]
