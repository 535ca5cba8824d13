"""Simulated servos behind a TCP socket, and behind pyserial's own server of RFC 2217.

Servos and host share simulated time, which stands still while bytes are under way through the
operating system: however busy the machine is, no reply is late.
"""

import importlib.resources
import math
import queue
import re
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
import serial
import serial.rfc2217

from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked
from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.robot.ports import URL_SCHEMES
from snakewalk.config.run import RunConfig
from snakewalk.controller.bench import torque_off
from snakewalk.controller.bench.adapter import permission
from snakewalk.controller.bench.doctor import examine
from snakewalk.controller.bench.scan import scan
from snakewalk.controller.cli.main import main
from snakewalk.controller.console.options import check_port_name
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.byte_port import DRAIN_LIMIT_S
from snakewalk.drivers.port.network_port import NetworkPort, open_port
from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

BAUD = 57600
LOOK_S = 1e-3
"""Simulated time between two looks at bytes that arrive."""
PATIENCE_S = 60.0
"""After so much real time a byte that was sent is lost, and the test fails."""
SERVO = ServoConfig(model="XL330-M288", supply_v=5.0, baud=BAUD)
ROBOT = RobotConfig(name="three", joint_axes="yyy", servo=SERVO)


class FarDevice:
    """What pyserial's server takes for its serial device: the line's baud rate."""

    cts = dsr = ri = cd = False
    bytesize, parity, stopbits = 8, serial.PARITY_NONE, 1

    def __init__(self, line: SimLine) -> None:
        self._line = line

    @property
    def baudrate(self) -> int:
        return self._line.getBaudRate()

    @baudrate.setter
    def baudrate(self, baud: int) -> None:
        self._line.setBaudRate(baud)

    def reset_input_buffer(self) -> None: ...

    def reset_output_buffer(self) -> None: ...


class FarEnd:
    """The other computer: a thread of its own takes what comes, ``exchange`` hands it on."""

    def __init__(self, kind: str) -> None:
        bank = ServoBank(ROBOT.servo_ids, SERVO.model, BAUD)
        self.line = SimLine(bank, BenchPlant(3))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"{kind}://127.0.0.1:{self._listener.getsockname()[1]}"
        if kind == "rfc2217":
            self.url += f"?timeout={PATIENCE_S:g}"  # pyserial gives a server 3 s to answer
        self._manager: Any = None
        self._client: socket.socket | None = None
        self._came: queue.Queue[bytes] = queue.Queue()
        self.awaited_bytes = 0
        """How many the host has written that have not reached the line."""
        self.under_way_bytes = 0
        """How many the line has sent that the host has not read."""
        self._thread = threading.Thread(target=self._serve, args=[kind], daemon=True)
        self._thread.start()

    def exchange(self) -> None:
        """Bring all that the host wrote to the line, and what has arrived on its way back."""
        line = self.line
        line.settle()
        while self.awaited_bytes:
            data = self._came.get(timeout=PATIENCE_S)
            self.awaited_bytes -= len(data)
            line.write(data)
        line.settle()
        arrived = line.read_until(4096, line.clock.now_s())
        if arrived:
            self.under_way_bytes += len(arrived)
            self.write(b"".join(self._manager.escape(arrived)) if self._manager else arrived)

    def write(self, data: bytes) -> None:
        """Send; the name that pyserial's server calls."""
        assert self._client is not None
        self._client.sendall(data)

    def close(self) -> None:
        """End as a computer does that is switched off."""
        for one in (self._client, self._listener):
            if one is not None:
                with suppress(OSError):
                    one.shutdown(socket.SHUT_RDWR)
                one.close()
        self._thread.join(PATIENCE_S)

    def _serve(self, kind: str) -> None:
        with suppress(OSError):
            self._client = client = self._listener.accept()[0]
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if kind == "rfc2217":
                device: Any = FarDevice(self.line)
                self._manager = serial.rfc2217.PortManager(device, self)
            while data := client.recv(1024):
                meant = b"".join(self._manager.filter(data)) if self._manager else data
                if meant:
                    self._came.put(meant)


class ServedPort(NetworkPort):
    """A network port whose waiting lets simulated time pass at the far end."""

    def __init__(self, far: FarEnd) -> None:
        self._far = far
        super().__init__(far.url, BAUD, far.line.clock)

    def write(self, data: bytes) -> None:
        super().write(data)
        self._far.awaited_bytes += len(data)
        self._far.exchange()

    def read_until(self, count: int, deadline_s: float) -> bytes:
        far, clock, got = self._far, self._far.line.clock, b""
        while True:
            far.exchange()
            due = min(count - len(got), far.under_way_bytes)
            got += super().read_until(due, math.inf)  # they come: time stands still
            far.under_way_bytes -= due
            if len(got) == count or clock.now_s() >= deadline_s:
                return got
            event_s = far.line.next_event_s()
            look_s = deadline_s if event_s is None else max(event_s, clock.now_s() + LOOK_S)
            clock.sleep_until_s(min(look_s, deadline_s))


class PassingClock(SimClock):
    """A clock on which time passes by being looked at."""

    def now_s(self) -> float:
        self.advance(LOOK_S)
        return super().now_s()


@pytest.fixture
def far_end() -> Iterator[Callable[[str], FarEnd]]:
    made: list[FarEnd] = []

    def start(kind: str) -> FarEnd:
        made.append(FarEnd(kind))
        return made[-1]

    yield start
    for each in made:
        each.close()


@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")
@pytest.mark.parametrize("kind", ["socket", "rfc2217"])
def test_servos_answer_over_a_network(far_end: Callable[[str], FarEnd], kind: str) -> None:
    far = far_end(kind)
    with ServedPort(far) as port:
        assert [(each.servo_id, each.model) for each in scan(port, [BAUD]).servos] == [
            (1, "XL330-M288"),
            (2, "XL330-M288"),
            (3, "XL330-M288"),
        ]
        bus = DynamixelBus(port, ROBOT.models_by_id, latency_s=port.latency_s)
        chain = ServoChain(bus, ROBOT, watchdog_s=1.0, rate_hz=5.0)
        start = chain.enable()
        chain.write(JointCommand(port.clock.now_s(), start.position_rad + 0.3))
        port.clock.sleep_until_s(port.clock.now_s() + 0.3)
        state = chain.read()
        chain.disable()
        assert state.valid.all()
        assert (state.position_rad > start.position_rad + 0.1).all()
        assert port.setBaudRate(115200) == (kind == "rfc2217")
        assert far.line.getBaudRate() == (115200 if kind == "rfc2217" else BAUD)
        assert port.drain_until_quiet(0.05) == 0
        assert port.read_until(4, port.clock.now_s()) == b""
        far.close()
        with pytest.raises(PortError, match=f"{kind}://127.0.0.1:.*: the port is gone"):
            NetworkPort.read_until(port, 1, math.inf)
    with pytest.raises(PortError, match="is closed"):
        port.write(b"\xff")
    with pytest.raises(PortError, match="cannot be opened"):
        port.openPort()


def test_doctor_and_torque_off_over_a_network(
    far_end: Callable[[str], FarEnd], monkeypatch: pytest.MonkeyPatch
) -> None:
    far = far_end("socket")
    with ServedPort(far) as port:
        assert permission(port.name).grade == "ok"
        findings = examine(
            port,
            ROBOT,
            RunConfig(name="slow", motion="source", cycle_hz=5.0),
            latency_s=port.latency_s,
            latency_timer_ms=port.latency_timer_ms,
        )
        assert "fail" not in [each.grade for each in findings]
        DynamixelBus(port, SERVO.model, latency_s=port.latency_s).write(2, "Torque Enable", 1)
        monkeypatch.setattr(torque_off, "open_port", lambda device, baud: port)
        outcome = torque_off.torque_off(far.url, [BAUD])
        assert outcome.safe
        assert outcome.text == "3 servos confirm it at 57600 baud"
        assert far.line.shown("Torque Enable").tolist() == [0, 0, 0]


def test_a_read_ends_with_its_bytes_or_its_deadline_and_noise_holds_nobody() -> None:
    clock = PassingClock()
    with (
        socket.create_server(("127.0.0.1", 0)) as listener,
        NetworkPort(f"socket://127.0.0.1:{listener.getsockname()[1]}", clock=clock) as port,
        listener.accept()[0] as far,
    ):
        assert port.read_until(3, clock.now_s() + 0.02) == b""
        far.sendall(b"abcde")
        assert port.read_until(3, math.inf) == b"abc"
        assert port.read_until(2, math.inf) == b"de"
        far.sendall(bytes(1 << 15))  # as much as fits into any buffer
        assert port.read_until(1, math.inf) == b"\0"
        before_s = clock.now_s()
        assert port.drain_until_quiet(0.01) > 0
        assert clock.now_s() - before_s < 0.02 + DRAIN_LIMIT_S
        before_s = clock.now_s()
        port.clearPort()
        assert clock.now_s() - before_s < 0.02 + DRAIN_LIMIT_S
        assert port.getBytesAvailable()  # the noise goes on


@pytest.mark.parametrize("url", ["socket://127.0.0.1", "socket://"])
def test_a_url_that_leads_nowhere_is_told(url: str) -> None:
    with pytest.raises(PortError, match=f"{url}: cannot be opened"):
        NetworkPort(url)


def schemes_of_pyserial() -> list[str]:
    handlers = importlib.resources.files("serial.urlhandler").iterdir()
    found = (re.fullmatch(r"protocol_(\w+)\.py", each.name) for each in handlers)
    return [each[1] for each in found if each]


def test_only_three_schemes_of_pyserial_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = list[str]()
    monkeypatch.setattr(serial, "serial_for_url", lambda url, *_, **__: opened.append(url))
    schemes = schemes_of_pyserial()
    assert {"spy", "hwgrep", "alt", *URL_SCHEMES} <= {*schemes, "snakewalk"}
    for scheme in [*schemes, "telephone", "SPY"]:
        url = f"{scheme}://127.0.0.1:5000?file={tmp_path}/precious"
        if scheme in URL_SCHEMES:
            with suppress(AttributeError):  # the line that is None
                NetworkPort(url)
            assert opened.pop() == url
        else:
            for use in (NetworkPort, open_port, check_port_name, check_ports_table):
                with pytest.raises(InputError, match=f"a port cannot be a URL of {scheme}://; use"):
                    use(url)
    assert opened == []
    assert not list(tmp_path.iterdir())


def check_ports_table(url: str) -> None:
    tables = [{"port": url, "ids": [1]}, {"port": "sim", "ids": [2]}]
    checked(RobotConfig, {"name": "x", "joint_axes": "yp", "ports": tables}, "robot.toml")


@pytest.mark.parametrize("place", ["", "pi", "pi:", "pi:0", "pi:65536", "pi:x", ":5000", "[::1"])
@pytest.mark.parametrize("kind", ["socket", "rfc2217"])
def test_a_url_without_host_and_port_is_told_what_is_expected(kind: str, place: str) -> None:
    with pytest.raises(PortError, match=f"expected {kind}://HOST:PORT, as {kind}://pi:5000"):
        NetworkPort(f"{kind}://{place}")


@pytest.mark.parametrize(
    "command",
    [
        "bus scan",
        "doctor",
        "stop",
        "bus calibrate -o r.toml",
        "bus inventory",
        "bus backup -o b.json",
        "bus blink --id 1",
        "bus reboot --id 1",
        "bus set --id 1 --new-id 2",
    ],
)
def test_commands_reject_a_url_that_writes_to_a_file(
    command: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    precious = tmp_path / "precious"
    precious.write_text("results")
    words = ["snakewalk", *command.split(), "--port", f"spy:///dev/null?file={precious}"]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert f"{words[-1]}: a port cannot be a URL of spy://" in capsys.readouterr().err
    assert precious.read_text() == "results"


def test_a_device_is_opened_as_before(servo_bus: Callable[..., Any]) -> None:
    with open_port(servo_bus("1").path) as port:
        assert isinstance(port, SerialPort)
