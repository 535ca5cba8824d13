"""The fixture's bus: registers and loads set by a test, lateness in reports, and light imports."""

import json
import math
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import serial

from snakewalk.config.errors import ConfigError, InputError
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.packet import InstructionPacket, encode_instruction
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.serve.pty import IDLE_S, LATE_S, PtyServer
from snakewalk.sim.serve.pytest_plugin import _BUSES, make_buses, pytest_runtest_makereport
from snakewalk.sim.serve.servo_bus import ServoBus
from tests.helpers.bus import a_line

MakeBus = Callable[..., ServoBus]


def test_registers_and_loads_are_set_in_simulated_time(servo_bus: MakeBus) -> None:
    bus = servo_bus("1,4,7")
    bus.set("homing offset", 100, ids=[4])
    bus.set("Drive Mode", 1)
    assert bus["Homing Offset"].tolist() == [0, 100, 0]
    assert bus["Drive Mode"].tolist() == [1, 1, 1]
    start = bus["Present Position"].copy()
    bus.load(0.5, ids=[1])
    bus.line.clock.advance(0.2)
    moved = abs(bus["Present Position"] - start) > 50
    assert moved.tolist() == [True, False, False]


def test_registers_are_set_while_the_bus_is_served(servo_bus: MakeBus) -> None:
    bus = servo_bus("1-2")
    assert bus.lateness is None
    assert bus.path
    bus.set("Homing Offset", -7, ids=[2])
    assert bus["Homing Offset"].tolist() == [0, -7]
    with pytest.raises(InputError, match="no servo has ID 9; the bus has 1, 2"):
        bus.load(0.1, ids=[9])
    assert bus.lateness is not None
    assert bus.lateness.startswith("bus.path: served up to ")


def test_protocol_1_servos_have_the_same_calls(servo_bus: MakeBus) -> None:
    bus = servo_bus("3:AX-12A")
    bus.set("Torque Limit", 500)
    assert bus["Torque Limit"].tolist() == [500]


def test_a_misspelt_register_has_the_closest_names(servo_bus: MakeBus) -> None:
    bus = servo_bus("1")
    with pytest.raises(KeyError, match=r"Goal Positon: no register .* did you mean Goal Position"):
        _ = bus["Goal Positon"]
    with pytest.raises(InputError, match="did you mean Homing Offset"):
        bus.set("Homing Ofset", 3)
    with pytest.raises(InputError, match="Present Position: is measured, not set"):
        bus.set("Present Position", 3)
    with pytest.raises(ControlTableError):
        bus.set("Torque Enable", 300)


@pytest.mark.parametrize("load_n_m", [math.nan, math.inf])
def test_a_load_that_is_not_finite_is_rejected(servo_bus: MakeBus, load_n_m: float) -> None:
    """It made the simulated shafts NaN."""
    bus = servo_bus("1-2")
    with pytest.raises(InputError, match="must be a finite number of N m"):
        bus.load(load_n_m)


def test_a_register_has_whole_numbers(servo_bus: MakeBus) -> None:
    bus = servo_bus("1-2")
    with pytest.raises(InputError, match=r"Goal Position 1.5: must be a whole number"):
        bus.set("Goal Position", 1.5)  # type: ignore[arg-type]
    bus.set("Goal Position", np.int64(2100), ids=[2])
    assert bus["Goal Position"].tolist() == [2048, 2100]


def test_the_server_measures_how_late_it_came() -> None:
    clock = SimClock()
    with PtyServer(a_line(), clock) as server:
        clock.advance(IDLE_S)
        server.step(0.0)
        assert server.latest_s == pytest.approx(0.0)
        clock.advance(0.3)
        server.step(0.0)
        assert server.latest_s == pytest.approx(0.3 - IDLE_S)
        assert server.missed_s == pytest.approx(0.3 - LATE_S)


@pytest.mark.parametrize("late_s", [0.0, 0.212])
def test_the_report_of_a_failed_test_states_how_late_the_bus_was(late_s: float) -> None:
    """It was `assert -3001 == 0` without a reason."""
    bus = ServoBus("1")
    try:
        assert bus.path
        server = bus._server
        assert server is not None
        server.serve = lambda stopped: None  # type: ignore[method-assign]
        bus._stop.set()
        server.latest_s = late_s
        item = SimpleNamespace(stash=pytest.Stash())
        item.stash[_BUSES] = [bus]
        item.listchain = lambda: [item]
        report = SimpleNamespace(when="call", failed=True, sections=[])
        hook = pytest_runtest_makereport(item)  # type: ignore[arg-type]
        next(hook)
        with pytest.raises(StopIteration):
            hook.send(SimpleNamespace(get_result=lambda: report))
        ((title, text),) = report.sections
        assert title == "servo_bus"
        assert text.startswith("bus.path: served up to ")
        if late_s:
            assert "up to 212 ms late" in text
            assert "fewer workers (-n)" in text
    finally:
        bus.close()


LEFT_OUT = ("numba", "llvmlite", "scipy", "networkx", "typer", "rich", "mcap", "dynamixel_sdk")
IMPORTS = f"""
import json, sys
before = set(sys.modules)
class LeftOut:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {LEFT_OUT!r}:
            raise ModuleNotFoundError(name, name=name)
sys.meta_path.insert(0, LeftOut())
import snakewalk.sim.serve.pytest_plugin
plugin = sorted(name for name in sys.modules if name.startswith("snakewalk"))
from snakewalk.sim.serve.servo_bus import ServoBus
ServoBus("1-2")["Present Position"]
known = {{name.partition(".")[0] for name in set(sys.modules) - before}}
known = [name for name in known if not name.startswith("_sysconfigdata")]
print(json.dumps([plugin, sorted(set(known) - set(sys.stdlib_module_names))]))
"""
LIGHT = {
    *("snakewalk", "numpy", "pydantic", "pydantic_core", "typing_extensions"),
    *("annotated_types", "typing_inspection", "serial"),
    *("pytest", "_pytest", "pluggy", "iniconfig", "packaging", "pygments", "py"),
}
"""Packages that a light install has; all others must wait until a feature needs them."""


@pytest.mark.slow
def test_the_fixture_imports_only_packages_of_the_light_install() -> None:
    done = subprocess.run(
        [sys.executable, "-c", IMPORTS], capture_output=True, text=True, check=True, timeout=600
    )
    plugin, known = json.loads(done.stdout)
    assert plugin == [
        *("snakewalk", "snakewalk.sim", "snakewalk.sim.serve"),
        "snakewalk.sim.serve.pytest_plugin",
    ]
    assert set(known) <= LIGHT


@pytest.mark.parametrize("model", ["XM430-W350", "STS3215", "AX-12A"])
def test_a_fault_begins_in_the_middle_of_a_test_and_ends(servo_bus: MakeBus, model: str) -> None:
    bus = servo_bus(f"1-2:{model}")
    bus.line.clock.advance(0.5)

    def replies() -> bool:
        instruction = bytes([0xFF, 0xFF, 2, 2, 1, 0xFA])
        if model == "XM430-W350":
            instruction = encode_instruction(InstructionPacket(2, 1))
        bus.line.writePort(instruction)
        bus.line.clock.advance(0.01)
        return bool(bus.line.readPort(30))

    assert replies()
    bus.fault("mute", ids=[2], for_s=0.2)
    assert not replies()
    bus.line.clock.advance(0.3)
    assert replies()
    with pytest.raises(ConfigError, match="fault"):
        bus.fault("mutes")


def test_packets_are_recorded_and_reported(servo_bus: MakeBus) -> None:
    bus = servo_bus([3, 5])
    bus.line.writePort(encode_instruction(InstructionPacket(5, 2, bytes([11, 0, 1, 0]))))
    bus.line.clock.advance(0.01)
    bus.line.readPort(30)
    assert [(p.kind, p.servo_id, p.values) for p in bus.packets] == [
        ("question", 5, {"Operating Mode": "?"}),
        ("answer", 5, {"Operating Mode": 3}),
    ]


def test_the_report_names_a_client_with_another_baud_rate(servo_bus: MakeBus) -> None:
    bus = servo_bus("1", baud=57_600)
    assert bus.path
    bus.line.setBaudRate(115_200)
    assert bus.lateness is not None
    assert "the client uses 115200 baud, the servos 57600" in bus.lateness


def test_a_module_shares_its_bus(module_servo_bus: MakeBus) -> None:
    assert module_servo_bus("1-2")["ID"].tolist() == [1, 2]


def test_a_port_of_pyserial_has_simulated_time(servo_bus: MakeBus) -> None:
    bus = servo_bus("1")
    with serial.serial_for_url(bus.url, 1_000_000, timeout=0.05) as port:
        port.write(encode_instruction(InstructionPacket(1, 1)))
        looks = 0
        while port.in_waiting < 14:
            looks += 1
        assert 0 < looks < 100
        assert len(port.read(14)) == 14
        begin_s = bus.line.clock.now_s()
        assert port.read(3) == b""
        assert bus.line.clock.now_s() == pytest.approx(begin_s + 0.05)
        port.timeout = None
        with pytest.raises(serial.SerialException, match=r"waits without end for 3 bytes"):
            port.read(3)
        port.baudrate = 57_600
        assert "the client uses 57600 baud" in str(bus.lateness) or bus.lateness is None
        bus.fault("port", for_s=1.0)
        bus.line.clock.advance(0.01)
        with pytest.raises(serial.SerialException, match="vanished"):
            port.write(b"a")
    with pytest.raises(serial.SerialException, match="not open"):
        port.read()
    bus.close()
    with pytest.raises(serial.SerialException, match="no bus has this URL"):
        serial.serial_for_url(bus.url)


def test_virtual_time_is_of_one_thread_and_ends_with_the_test() -> None:
    before = (time.sleep, time.monotonic, time.time, time.perf_counter)
    fixture = make_buses(SimpleNamespace(stash=pytest.Stash()))  # type: ignore[arg-type]
    bus = next(fixture)("1", virtual_time=True)
    begin_s, elsewhere_s = time.monotonic(), [0.0]
    try:
        time.sleep(500.0)
        other = threading.Thread(target=lambda: elsewhere_s.append(time.monotonic()))
        other.start()
        other.join()
        passed_s = time.monotonic() - begin_s
    finally:
        assert next(fixture, None) is None
    assert passed_s == pytest.approx(500.0)
    assert bus.line.clock.now_s() == pytest.approx(500.0)
    assert elsewhere_s[1] < begin_s + 250.0
    assert (time.sleep, time.monotonic, time.time, time.perf_counter) == before


PAGE = (Path(__file__).resolve().parents[3] / "docs/start/ci.md").read_text(encoding="utf-8")
BLOCKS = [part.partition("```")[0] for part in PAGE.split("```python")]
FIVE, PYSERIAL = (part for part in BLOCKS if "PacketHandler" in part or "import serial" in part)
TESTS = [
    (block, name)
    for block in (FIVE, PYSERIAL)
    for name in re.findall(r"^def (test_\w+)", block, re.MULTILINE)
]


@pytest.mark.parametrize(("block", "name"), TESTS, ids=[name for _, name in TESTS])
def test_the_tests_of_the_page_pass(servo_bus: MakeBus, block: str, name: str) -> None:
    names: dict[str, Callable[[MakeBus], None]] = {}
    exec(block, names)
    names[name](servo_bus)


def test_the_page_has_five_tests() -> None:
    assert FIVE.count("def test_") == 5
