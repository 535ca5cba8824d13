"""The servos behind a pseudo-terminal: by hand with a simulated clock, and in real time."""

import math
import os
import select
import termios
import threading
from pathlib import Path
from typing import Any

import dynamixel_sdk as sdk
import pytest

from snakewalk.config.errors import InputError
from snakewalk.drivers.clock import WallClock
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.serve.pty import PACE_MAX, PtyServer
from tests.helpers.bus import a_line, send_to, serve_for, take, write

PING = bytes.fromhex("FF FF FD 00 01 03 00 01 19 4E")


def test_answers_come_when_their_bytes_are_due() -> None:
    clock = SimClock()
    with PtyServer(a_line(1), clock) as server:
        client = os.open(server.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            send_to(server, client, PING[:4])
            server.step(0.0)
            send_to(server, client, PING[4:])
            server.step(0.0)
            with pytest.raises(BlockingIOError):
                os.read(client, 99)
            clock.advance(100e-6 + 50e-6)  # ten bytes out, five of fourteen back
            server.step(0.0)
            assert take(client, 5) == b"\xff\xff\xfd\x00\x01"
            clock.advance(1e-3)
            server.step(0.0)
            assert len(take(client, 9)) == 9
        finally:
            os.close(client)


def test_a_client_that_flushes_its_output_is_told_of() -> None:
    clock = SimClock()
    with PtyServer(a_line(1), clock) as server:
        client = os.open(server.path, os.O_RDWR | os.O_NOCTTY)
        try:
            send_to(server, client, PING)
            termios.tcdrain(client)
            server.step(0.0)
            assert server.output_flushes == 0
            for _ in range(2):
                termios.tcflush(client, termios.TCOFLUSH)
                server.step(0.0)
            assert server.output_flushes == 2
            for _ in range(2):
                termios.tcflush(client, termios.TCOFLUSH)
            server.step(0.0)
            assert server.output_flushes == 3  # the kernel tells of both as of one
            send_to(server, client, PING)
            while not select.select([client], [], [], 0.0)[0]:
                clock.advance(1e-3)
                server.step(0.0)
        finally:
            os.close(client)


def test_a_flush_after_the_last_look_is_counted() -> None:
    with PtyServer(a_line(1), SimClock()) as server:
        client = os.open(server.path, os.O_RDWR | os.O_NOCTTY)
        termios.tcflush(client, termios.TCOFLUSH)
    os.close(client)
    assert server.output_flushes == 1


def test_a_client_that_discards_its_input_has_flushed_no_output() -> None:
    with PtyServer(a_line(1), SimClock()) as server:
        client = os.open(server.path, os.O_RDWR | os.O_NOCTTY)
        termios.tcflush(client, termios.TCIFLUSH)
        server.step(0.0)
        os.close(client)
    assert server.output_flushes == 0


@pytest.mark.parametrize(
    ("pace", "fault"),
    [
        (0.0, "must be above 0"),
        (-1.0, "must be above 0"),
        (math.nan, "must be above 0"),
        (math.inf, f"must be at most {PACE_MAX:g}"),
        (1.001 * PACE_MAX, f"must be at most {PACE_MAX:g}"),
    ],
)
def test_a_pace_is_positive_and_bounded(pace: float, fault: str) -> None:
    with PtyServer(a_line(1), SimClock(), pace=PACE_MAX) as server:
        with pytest.raises(InputError, match=fault):
            server.set_pace(pace)
        server.set_pace(0.5)
        assert server.real_time_s(1.5) - server.real_time_s(1.0) == pytest.approx(1.0)


def test_a_device_that_was_unplugged_comes_back_with_the_line() -> None:
    line = a_line(1)
    with PtyServer(line, SimClock()) as server:
        line.disconnect()
        server.step(0.0)
        assert server.path == ""
        server.step(0.0)
        assert server.path == ""
        line.reconnect()
        server.step(0.0)
        assert os.path.exists(server.path)
        client = os.open(server.path, os.O_RDWR | os.O_NOCTTY)
        os.close(client)


class CountingClock(SimClock):
    """Ten microseconds pass between two looks at it."""

    def now_s(self) -> float:
        self.advance(1e-5)
        return super().now_s()


def test_a_reply_that_is_due_soon_is_awaited_without_sleep(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, naps = CountingClock(), list[float]()
    with PtyServer(a_line(1), clock) as server:
        client = os.open(server.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        look = select.select

        def sleep(*ends_and_wait: Any) -> Any:
            naps.append(ends_and_wait[3])
            return look(*ends_and_wait[:3], 0.0)

        try:
            send_to(server, client, PING)
            server.step(1e-3)
            with monkeypatch.context() as patched:
                patched.setattr(select, "select", sleep)
                for _ in range(9):
                    server.step(1e-3)
            assert take(client, 5) == b"\xff\xff\xfd\x00\x01"
        finally:
            os.close(client)
    assert set(naps) == {0.0}


def test_physics_runs_on_while_nobody_talks_and_clients_come_and_go() -> None:
    clock = SimClock()
    line = a_line(1)
    write(line, 1, 64, 1, 1)
    write(line, 1, 116, 2400, 4)
    with PtyServer(line, clock) as server:
        for _ in range(2):
            os.close(os.open(server.path, os.O_RDWR | os.O_NOCTTY))
            serve_for(server, clock, 0.5)
        assert line.firmware.plant.position_rad[0] > 0.4
        path = server.path
    server.close()
    assert not os.path.exists(path)


@pytest.mark.usefixtures("patient_sdk")
def test_the_sdk_opens_it_as_a_serial_port() -> None:
    stop = threading.Event()
    ph = sdk.PacketHandler(2.0)
    with PtyServer(a_line(4), WallClock()) as server:
        thread = threading.Thread(target=server.serve, args=(stop.is_set,))
        thread.start()
        port = sdk.PortHandler(server.path)
        try:
            assert port.openPort()
            assert ph.ping(port, 2) == (1020, sdk.COMM_SUCCESS, 0)
            assert ph.write4ByteTxRx(port, 2, 116, 2100) == (sdk.COMM_SUCCESS, 0)
            reads = sdk.GroupSyncRead(port, ph, 116, 4)
            for servo in range(1, 5):
                reads.addParam(servo)
            assert reads.txRxPacket() == sdk.COMM_SUCCESS
            assert [reads.getData(s, 116, 4) for s in range(1, 5)] == [2048, 2100, 2048, 2048]
            assert reads.fastSyncRead() == sdk.COMM_SUCCESS
        finally:
            port.closePort()
            stop.set()
            thread.join(5.0)
    assert not thread.is_alive()


def test_a_second_server_never_takes_the_firsts_link(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    with PtyServer(a_line(), SimClock(), link=link) as first:
        with pytest.raises(InputError, match=f"is there already, and leads to {first.path}"):
            PtyServer(a_line(), SimClock(), link=link)
        assert os.readlink(link) == first.path
    assert not link.is_symlink()
    link.symlink_to("/dev/pts/none")  # of a server that was killed
    with PtyServer(a_line(), SimClock(), link=link) as third:
        assert os.readlink(link) == third.path
    link.write_text("mine")
    with pytest.raises(InputError, match="is there already, and is no link"):
        PtyServer(a_line(), SimClock(), link=link)
    assert link.read_text() == "mine"


def test_the_link_of_a_killed_server_is_taken_where_its_device_is_ours_now(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The system gives the lowest free number: the new device has the old one's name."""
    link = tmp_path / "tty"
    ends = os.openpty()
    link.symlink_to(os.ttyname(ends[1]))
    monkeypatch.setattr(os, "openpty", lambda: ends)
    with PtyServer(a_line(), SimClock(), link=link) as server:
        assert os.readlink(link) == server.path
    assert not link.is_symlink()


def test_a_link_that_another_program_changes_is_reported_when_it_happens(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    link, clock = tmp_path / "tty", SimClock()
    with PtyServer(a_line(), clock, link=link) as server:
        link.unlink()
        clock.advance(1.5)
        server.step(0.0)
        assert os.readlink(link) == server.path
        link.unlink()
        link.symlink_to("/dev/null")
        clock.advance(1.5)
        server.step(0.0)
        path = server.path
    assert [each.getMessage() for each in caplog.records] == [
        f"{link}: was deleted; it leads to {path} again",
        f"{link}: leads to /dev/null now; the servos are at {path}",
    ]
    assert os.readlink(link) == "/dev/null"  # another's is left alone


def test_a_link_that_a_file_replaces_is_reported_and_the_file_stays(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    link, clock = tmp_path / "tty", SimClock()
    with PtyServer(a_line(), clock, link=link) as server:
        link.unlink()
        link.write_text("mine")
        clock.advance(1.5)
        server.step(0.0)
        path = server.path
    (record,) = caplog.records
    assert record.getMessage() == f"{link}: leads to a file now; the servos are at {path}"
    assert link.read_text() == "mine"
