"""``snakewalk bus serve`` and ``bus sniff`` from the outside; the plugin's fixture."""

import json
import os
import re
import signal
import termios
import time
from collections.abc import Callable
from pathlib import Path

import dynamixel_sdk as sdk
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.robot import ImuConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.imu_reader import ImuReader
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.serve import pty
from snakewalk.sim.serve.chain_spec import BENCH_RANGES
from snakewalk.sim.serve.pty import LATE_S, PtyServer
from snakewalk.sim.serve.servo_bus import ServoBus
from tests.helpers.bus import a_line, send_to, serve_for, take
from tests.helpers.command import snakewalk
from tests.helpers.program import command
from tests.sim.faults.test_faults import fault, scripted

pytestmark = pytest.mark.usefixtures("patient_sdk")

PING = bytes.fromhex("FF FF FD 00 01 03 00 01 19 4E")


@pytest.mark.slow
def test_serve_says_where_and_what_and_sniff_reads_its_recording(tmp_path: Path) -> None:
    record = tmp_path / "exchange.jsonl"
    link = tmp_path / "tty"
    words = ("--servos", "1-2:XL330-M288", "--json")
    with command("bus", "serve", *words, "--record", str(record), "--link", str(link)) as process:
        first = json.loads(process.stdout.readline())
        assert first["ids"] == [1, 2]
        port = sdk.PortHandler(str(link))
        port.setBaudRate(1_000_000)
        handler = sdk.PacketHandler(2.0)
        assert handler.ping(port, 2) == (1200, 0, 0)
        port.setBaudRate(57_600)
        port.getCurrentTime = lambda: 1e3 * time.time()  # no reply comes, so without patience
        assert handler.ping(port, 2)[1] == sdk.COMM_RX_TIMEOUT  # servos at 1 Mbaud are silent
        port.closePort()
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate()
    done = json.loads(out)
    assert (done["answers"], done["output_flushes"]) == (1, 0)
    assert not link.exists()
    sniffed = snakewalk("bus", "sniff", str(record), "--json")
    assert sniffed.returncode == 0, sniffed.stderr
    lines = [json.loads(line) for line in sniffed.stdout.splitlines()]
    assert [line["name"] for line in lines][:2] == ["ping", "ok"]
    assert lines[1]["values"]["model"] == "XL330-M288"


@pytest.mark.slow_cases(2, "7 cases of 0.4 s of CPU")
@pytest.mark.fast_cases(3)
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("serve", "--servos", "1-300"), "ID 300: a servo has 0 to 252"),
        (("serve", "--servos", "1", "--baud", "1234"), "1234 baud: XM430-W350 has 9600"),
        (("serve", "--servos", "1:XL-9"), "XL-9: no such servo model"),
        (("serve", "--pace", "0"), "pace 0: must be above 0"),
        (("serve", "--faults", "nowhere.toml"), "nowhere.toml: No such file"),
        (("serve", "--servos", "1-4", "--imu", "4"), "--imu 4: a servo has this ID"),
        (("serve", "--servos", "1-4", "--imu", "200:BNO"), "no such model; there are imu_to_dxl"),
        (("serve", "--robot", "yaw16", "--imu", "200"), "describes its IMU in the table [imu]"),
        (("serve", "--servos", "1:AX-12A", "--imu", "9"), "1.0 and imu_to_dxl Protocol 2.0"),
        (("sniff", "nowhere.jsonl"), "nowhere.jsonl: no such file"),
    ],
)
def test_wrong_input_is_one_line_and_exit_code_2(words: tuple[str, ...], said: str) -> None:
    ended = snakewalk("bus", *words)
    assert ended.returncode == 2
    assert said in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def test_the_pty_vanishes_and_comes_back_behind_its_link(tmp_path: Path) -> None:
    line = scripted(fault("port", at_s=1.0, for_s=1.0), joints=1)
    clock, link = SimClock(), tmp_path / "tty"
    with PtyServer(line, clock, link=link) as server:
        first = server.path
        serve_for(server, clock, 1.1)
        assert not server.path
        assert not os.path.exists(first)
        assert not link.exists()
        serve_for(server, clock, 1.0)
        client = os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            send_to(server, client, PING)
            for _ in range(3):
                server.step(0.0)
                clock.advance(0.01)
            assert len(take(client, 14)) == 14
        finally:
            os.close(client)


def test_pace_stretches_time() -> None:
    clock = SimClock()
    line = a_line(1)
    start_s = line.clock.now_s()
    with PtyServer(line, clock, pace=0.25) as server:
        serve_for(server, clock, 2.0)
    assert line.clock.now_s() - start_s == pytest.approx(0.5)


def test_pace_changes_while_it_serves() -> None:
    clock, line = SimClock(), a_line(1)
    start_s = line.clock.now_s()
    with PtyServer(line, clock) as server:
        serve_for(server, clock, 1.0)
        server.set_pace(0.25)
        server.step(0.0)
        assert line.clock.now_s() - start_s == pytest.approx(1.0)
        serve_for(server, clock, 2.0)
        with pytest.raises(InputError, match="must be above 0"):
            server.set_pace(0.0)
    assert line.clock.now_s() - start_s == pytest.approx(1.5)


def test_a_console_reads_lines_from_a_pipe(monkeypatch: pytest.MonkeyPatch) -> None:
    hears, says = os.pipe()
    os.write(says, b"get 1 Present Position\n\nset 1 LED 1\nquit\n")
    with os.fdopen(hears) as typed:
        monkeypatch.setattr("sys.stdin", typed)
        done = snakewalk("bus", "serve", "--servos", "1", "--console")
    os.close(says)
    assert done.stdout.splitlines()[2:] == ["1: 2048", "LED = 1 at 1 servo"]
    assert snakewalk("bus", "serve", "--servos", "1", "--console", "--json").returncode == 2
    assert snakewalk("bus", "serve", "--servos", "1:AX-12A", "--console").returncode == 2


def test_time_that_the_server_missed_is_left_out() -> None:
    clock, line = SimClock(), a_line(1)
    start_s = line.clock.now_s()
    with PtyServer(line, clock) as server:
        clock.advance(5.0)
        server.step(0.0)
        assert line.clock.now_s() - start_s == pytest.approx(LATE_S)
        serve_for(server, clock, 1.0)
        assert line.clock.now_s() - start_s == pytest.approx(LATE_S + 1.0)
        assert server.missed_s == pytest.approx(5.0 - LATE_S)


def test_three_lines_are_enough_for_a_test_suite(servo_bus: Callable[..., ServoBus]) -> None:
    bus = servo_bus("1-3", start_rad=0.5)
    assert sdk.PacketHandler(2.0).write1ByteTxRx(bus.line, 2, 65, 1) == (0, 0)
    assert bus["LED"].tolist() == [0, 1, 0]
    assert (bus["Present Position"] > 2300).all()


def test_the_fixture_takes_faults(servo_bus: Callable[..., ServoBus], tmp_path: Path) -> None:
    path = tmp_path / "faults.toml"
    path.write_text(fault("mute", ids=[2]))
    bus = servo_bus("1-3", faults=path)
    handler = sdk.PacketHandler(2.0)
    bus.line.clock.advance(0.01)
    assert handler.ping(bus.line, 1)[1] == sdk.COMM_SUCCESS
    assert handler.ping(bus.line, 2)[1] == sdk.COMM_RX_TIMEOUT


def test_serve_tells_of_a_client_that_flushes_its_output() -> None:
    with command("bus", "serve", "--servos", "1") as process:
        line = process.stdout.readline() or process.stderr.readline()
        found = re.search(r"/dev/\S+", line)
        assert found is not None, line
        client = os.open(found[0], os.O_RDWR | os.O_NOCTTY)
        for _ in range(3):
            termios.tcflush(client, termios.TCIOFLUSH)
            os.write(client, PING)
            take(client, 14)  # the whole answer: the server has seen the flush
        process.send_signal(signal.SIGINT)
        _, said = process.communicate()
        os.close(client)
    assert (
        "a client flushed its output at least 3 times: bytes that it sent less than 5 ms before"
        in said
    )


def test_serve_speaks_protocol_1_for_an_ax12() -> None:
    with command("bus", "serve", "--servos", "5:AX-12A", "--json") as process:
        port = sdk.PortHandler(json.loads(process.stdout.readline())["port"])
        port.setBaudRate(1_000_000)
        assert sdk.PacketHandler(1.0).ping(port, 5) == (12, 0, 0)
        port.closePort()
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate()
    assert json.loads(out)["answers"] == 2  # the SDK reads the model number, too


def test_an_imu_lies_still_beside_the_servos(servo_bus: Callable[..., ServoBus]) -> None:
    """The SDK finds it, and our reader its attitude: level, and turned by its bias alone."""
    bus = servo_bus("1-2", imu="200:FFW-G40-IMU")
    handler = sdk.PacketHandler(2.0)
    assert sorted(handler.broadcastPing(bus.line)[0]) == [1, 2, 200]
    config = ImuConfig(model="FFW-G40-IMU", id=200, **BENCH_RANGES)
    reader = ImuReader(DynamixelBus(bus.line), config)
    reader.find()
    for _ in range(50):
        bus.line.clock.advance(0.02)
        state = reader.read(lambda line: None)
    assert state is not None
    np.testing.assert_allclose(state.rotation[2], [0.0, 0.0, 1.0], atol=0.02)
    assert np.abs(state.rate_rad_s).max() < 0.01


def test_the_fixture_takes_servos_of_protocol_1(
    servo_bus: Callable[..., ServoBus], tmp_path: Path
) -> None:
    path = tmp_path / "faults.toml"
    path.write_text(fault("mute", ids=[2]))
    bus = servo_bus("1-3:AX-12A", faults=path, start_rad=0.5)
    handler = sdk.PacketHandler(1.0)
    bus.line.clock.advance(0.01)
    assert handler.write1ByteTxRx(bus.line, 1, 25, 1) == (0, 0)
    assert handler.ping(bus.line, 2)[1] == sdk.COMM_RX_TIMEOUT
    assert bus["LED"].tolist() == [1, 0, 0]
    assert (bus["Present Position"] > 600).all()


def test_a_pace_that_the_machine_cannot_keep_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("bus", "serve", "--servos", "1", "--for", "0.05")
    assert "too slow" not in snakewalk(*words).stderr
    monkeypatch.setattr(pty, "LATE_S", -0.02)  # as if each step came 20 ms late
    assert "% slower than --pace: this machine is too slow" in snakewalk(*words).stderr
