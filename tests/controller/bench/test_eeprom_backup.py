"""Servos' settings as a file and back, restarts that clear an alarm, a LED that says which one."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.controller.bench.eeprom_backup import RestoreJournal, load_backup, plan_all
from snakewalk.controller.bench.servo_settings import apply, open_servo
from snakewalk.controller.cli.command_line import app
from snakewalk.drivers.errors import NoAnswerError
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.servo_bus import ServoBus
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

Call = Callable[..., tuple[int, str, BaseException | None]]


def open_as_port(line: object, monkeypatch: pytest.MonkeyPatch) -> None:
    line.latency_s = 0.0  # type: ignore[attr-defined]

    @contextmanager
    def opened(device: str, baud: int) -> Iterator[object]:
        yield line

    monkeypatch.setattr("snakewalk.drivers.port.network_port.open_port", opened)


@pytest.fixture
def line(monkeypatch: pytest.MonkeyPatch) -> SimLine:
    made = SimLine(ServoBank([7, 3], ["XM430-W350", "XL330-M288"]), BenchPlant(2))
    open_as_port(made, monkeypatch)
    return made


@pytest.fixture
def call(line: SimLine) -> Call:
    def run(*words: object) -> tuple[int, str, BaseException | None]:
        result = CliRunner().invoke(app, ["bus", *map(str, words), "--port", "any"])
        return result.exit_code, result.stdout, result.exception

    return run


def test_what_was_set_comes_back_and_nothing_else_is_touched(
    tmp_path: Path, line: SimLine, call: Call
) -> None:
    bank, file = line.bank, tmp_path / "servos.json"
    bank["Homing Offset"][:] = 100, -200
    bank["Temperature Limit"][0] = 70
    kept = bank.table.copy()
    assert call("backup", "-o", file)[0] == 0
    assert (bank.table[:, :64] == kept[:, :64]).all()  # reading changes nothing

    bank["Homing Offset"][:] = 0
    bank["Temperature Limit"][0] = 60
    bank["Torque Enable"][0] = 1
    code, out, _ = call("restore", file, "--dry-run", "--json")
    assert code == 0
    shown = json.loads(out)
    assert not shown["written"]
    assert shown["changes"] == {
        "7": {
            "Torque Enable": [1, 0],
            "Homing Offset": [0, 100],
            "Temperature Limit": [60, 70],
        },
        "3": {"Homing Offset": [0, -200]},
    }
    assert bank["Homing Offset"].tolist() == [0, 0]
    assert "bus restore asks first" in str(call("restore", file)[2])  # nobody to ask
    assert "--json: is for programs; leave it out" in str(call("restore", file, "--json")[2])
    assert bank["Homing Offset"].tolist() == [0, 0]
    assert call("restore", file, "--id", 3, "--yes")[0] == 0
    assert bank["Homing Offset"].tolist() == [0, -200]
    assert call("restore", file, "--yes")[0] == 0
    assert (bank.table[:, :64] == kept[:, :64]).all()
    assert "nothing to restore" in call("restore", file, "--yes")[1]


def test_a_file_that_is_not_of_these_servos_is_refused_before_anything_is_written(
    tmp_path: Path, line: SimLine, call: Call
) -> None:
    file = tmp_path / "servos.json"
    call("backup", "-o", file)
    assert isinstance(call("backup", "-o", file)[2], InputError)  # it exists
    text = file.read_text()
    line.bank["Homing Offset"][:] = 5
    for broken, said in (
        (text.replace("XL330-M288", "XM430-W350"), "ID 3: is a XL330-M288"),
        (text.replace('"Shutdown"', '"Shut down"'), "has no Shut down to restore"),
        (text.replace('"servos"', '"servo"'), "servos: is required"),
        ("[]", "expected a backup of servos"),
        ("{", "is not JSON"),
    ):
        file.write_text(broken)
        fault = call("restore", file, "--yes")[2]
        assert isinstance(fault, InputError)
        assert said in str(fault)
    file.write_text(text)
    assert "has no ID 9; it has 3, 7" in str(call("restore", file, "--id", 9)[2])
    assert line.bank["Homing Offset"].tolist() == [5, 5]


def test_all_values_are_checked_before_the_first_write(
    tmp_path: Path, line: SimLine, call: Call
) -> None:
    """A bad value at the second servo left the first one changed; a crossed limit was written."""
    file = tmp_path / "servos.json"
    call("backup", "-o", file)
    line.bank["Homing Offset"][:] = 5
    before = line.bank.table.copy()
    data = json.loads(file.read_text())
    by_id = {servo["id"]: servo["registers"] for servo in data["servos"]}
    by_id[3]["Temperature Limit"] = 900
    by_id[7]["Min Position Limit"] = 3000
    by_id[7]["Max Position Limit"] = 1000
    file.write_text(json.dumps(data))
    fault = call("restore", file, "--yes")[2]
    assert isinstance(fault, InputError)
    assert fault.faults == (
        "ID 3: Temperature Limit: 900 is not within 0 to 100",
        "ID 7: Min Position Limit 3000 is above Max Position Limit 1000",
    )
    assert (line.bank.table == before).all()


def test_an_interrupted_restore_is_continued_or_undone(
    tmp_path: Path, line: SimLine, call: Call
) -> None:
    file = tmp_path / "servos.json"
    undo = tmp_path / "servos.undo.json"
    line.bank["Homing Offset"][:] = 100, -200
    call("backup", "-o", file)
    line.bank["Homing Offset"][:] = 5, 6
    line.bank["Min Position Limit"][1] = 100  # the journal has only one end of the range
    servos = {servo.id: servo for servo in load_backup(file).servos}
    buses = {servo_id: open_servo(line, servo_id, 0.0) for servo_id in servos}

    def interrupt() -> None:
        plans = plan_all(buses, servos)
        RestoreJournal(file).note(plans, {i: bus.table.model for i, bus in buses.items()})
        apply(buses[3], 3, plans[3])
        assert line.bank["Homing Offset"].tolist() == [5, -200]

    interrupt()
    assert call("restore", undo, "--yes")[0] == 0
    assert line.bank["Homing Offset"].tolist() == [5, 6]
    assert not undo.exists()
    interrupt()
    assert call("restore", file, "--yes")[0] == 0
    assert line.bank["Homing Offset"].tolist() == [100, -200]
    assert not undo.exists()


def test_a_backup_of_feetech_servos_suits_another_firmware(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Read-only registers were in the backup, were written first, and ended the restore."""
    bus = ServoBus("1-2:STS3215")
    open_as_port(bus.line, monkeypatch)
    file = tmp_path / "servos.json"

    def call(*words: object) -> int:
        result = CliRunner().invoke(app, ["bus", *map(str, words), "--port", "any"])
        return result.exit_code

    assert call("backup", "-o", file, "--baud", 1_000_000) == 0
    data = json.loads(file.read_text())
    assert "Byte Order" not in data["servos"][0]["registers"]
    assert "Angular Resolution" in data["servos"][0]["registers"]
    data["servos"][0]["registers"]["Firmware Minor Version"] = 9  # as older backups have it
    file.write_text(json.dumps(data))
    bus.set("Phase", 140)
    bus.set("CW Dead Zone", 9)
    bus.line.bank["Firmware Minor Version"][:] = 11
    assert call("restore", file, "--yes", "--baud", 1_000_000) == 0
    assert bus["Phase"].tolist() == [12, 12]
    assert bus["CW Dead Zone"].tolist() == [1, 1]
    assert bus["Firmware Minor Version"].tolist() == [11, 11]


def test_settings_that_a_run_left_in_a_feetech_servo_are_no_backup(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its limits and gains are volatile until it is switched off; a restore would store them."""
    bus = ServoBus("1-2:STS3215")
    open_as_port(bus.line, monkeypatch)
    file = tmp_path / "servos.json"

    def call(*words: object) -> int:
        words = (*map(str, words), "--baud", "1000000", "--port", "any")
        return CliRunner().invoke(app, ["bus", *words]).exit_code

    assert call("backup", "-o", file) == 0
    bus.set("Velocity I Gain", 2)
    assert call("backup", "-o", tmp_path / "after.json") == 1
    assert call("restore", file, "--dry-run") == 1
    assert not (tmp_path / "after.json").exists()


def test_a_reboot_clears_an_alarm_and_asks_first(line: SimLine, call: Call) -> None:
    line.bank["Hardware Error Status"][0] = 0x20
    line.bank["Torque Enable"][1] = 1
    assert "bus reboot asks first" in str(call("reboot", "--id", 7)[2])  # nobody to ask
    assert line.bank["Hardware Error Status"][0] == 0x20
    code, out, _ = call("reboot", "--id", 7, "--yes")
    assert code == 0
    assert "alarm before: overload; now: none" in out
    assert line.bank["Hardware Error Status"][0] == 0
    assert line.bank["Torque Enable"][1] == 1  # the other one was not asked to
    assert isinstance(call("reboot", "--id", 9, "--yes")[2], NoAnswerError)


def test_only_the_led_of_the_servo_that_is_asked_for_blinks(line: SimLine, call: Call) -> None:
    seen: list[list[int]] = []
    advance = line.clock.sleep_until_s

    def look(time_s: float) -> None:
        seen.append(line.bank["LED"].tolist())
        advance(time_s)

    line.clock.sleep_until_s = look  # type: ignore[method-assign]
    before = line.firmware.plant.position_rad.copy()
    assert call("blink", "--id", 3, "--times", 2)[0] == 0
    changes = [now for last, now in pairwise(seen) if now != last]
    assert changes == [[0, 1], [0, 0]] * 2
    assert np.array_equal(line.firmware.plant.position_rad, before)
