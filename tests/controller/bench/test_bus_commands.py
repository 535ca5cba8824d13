"""``bus scan``, ``doctor`` and ``bus set`` as a user calls them, on a line of 16 servos."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from snakewalk.controller.cli.main import main
from snakewalk.drivers.chain.fingerprint import FINGERPRINT
from snakewalk.drivers.chain.fingerprint_file import FingerprintFile
from snakewalk.drivers.protocol.control_table import load_control_table
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.line_port import OpenedLine, line_port

pytestmark = pytest.mark.usefixtures("device")


@pytest.fixture
def line() -> OpenedLine:
    return OpenedLine(ServoBank(range(1, 17)), BenchPlant(16))


@pytest.fixture
def device(line: OpenedLine) -> Iterator[str]:
    with line_port(line) as name:
        yield name


def call(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *words: str
) -> tuple[int, str, str]:
    monkeypatch.setattr("sys.argv", ["snakewalk", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    said = capsys.readouterr()
    return int(ended.value.code or 0), said.out, said.err


def test_scan(
    device: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, _ = call(monkeypatch, capsys, "scan", "--port", device, "--json")
    found = json.loads(out)
    assert code == 0
    assert [servo["servo_id"] for servo in found["servos"]] == list(range(1, 17))
    assert found["servos"][0]["model"] == "XM430-W350"


def test_a_silent_bus_is_reported_with_the_rates_that_were_searched(
    device: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, _ = call(monkeypatch, capsys, "scan", "--port", device, "--baud", "57600")
    assert code == 1
    assert "no servo replies at 57600 baud; leave --baud out to search all rates" in out


def test_doctor(
    device: str,
    line: OpenedLine,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    line.bank["Hardware Error Status"][4] = 0x20
    code, out, _ = call(monkeypatch, capsys, "doctor", "--port", device, "--json")
    found = json.loads(out)
    grades = {f["check"]: f["grade"] for f in found["findings"]}
    assert (grades["return delay"], grades["alarms"]) == ("warn", "fail")
    assert grades["model"] == grades["supply"] == "ok"
    assert (code, found["worst"]) == (1, "fail")
    code, out, _ = call(monkeypatch, capsys, "doctor", "--port", device)
    assert code == 1
    assert "joint yaw_05 (ID 5): overload" in out
    assert "-> remove the cause" in out


def test_bus_set_shows_asks_and_writes(
    device: str,
    line: OpenedLine,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ("bus", "set", "--port", device, "--id", "16", "--new-id", "40")
    code, out, err = call(monkeypatch, capsys, *words)
    assert code == 2  # 0 although it had done nothing
    assert "ID" in out
    assert "bus set asks first, but a terminal is missing; nothing is changed; add --yes" in err
    assert line.bank["ID"][15] == 16
    code, out, err = call(monkeypatch, capsys, *words, "--json")
    assert (code, out) == (2, "")
    assert "--json: is for programs; leave it out" in err
    code, out, _ = call(monkeypatch, capsys, *words, "--dry-run", "--yes", "--json")
    assert not json.loads(out)["written"]
    assert line.bank["ID"][15] == 16
    code, out, _ = call(monkeypatch, capsys, *words, "--yes")
    assert code == 0
    assert "written and read back" in out
    assert line.bank["ID"][15] == 40


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("bus", "scan", "--port", "/dev/ttyNOPE"), "/dev/ttyNOPE: no such port"),
        (("bus", "scan", "--port", "DEVICE", "--baud", "1200"), "--baud 1200: servos have 9600"),
        (("doctor", "--port", "/dev/ttyNOPE"), "/dev/ttyNOPE: no such port"),
        (("doctor", "--port", "DEVICE", "--robot", "nope"), "nope"),
        (("bus", "set", "--port", "/dev/ttyNOPE", "--id", "1"), "/dev/ttyNOPE: no such port"),
        (("bus", "set", "--port", "DEVICE", "--id", "253"), "--id 253: a bus has IDs 0 to 252"),
        (
            ("bus", "set", "--port", "DEVICE", "--id", "1", "--new-baud", "1200"),
            "--new-baud 1200 baud: a XM430-W350 has 9600",
        ),
        (
            ("bus", "set", "--port", "DEVICE", "--id", "1", "--new-id", "2"),
            "--new-id 2: there is a servo with this ID already",
        ),
    ],
)
def test_wrong_input_is_one_line_and_code_2(
    device: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    said: str,
) -> None:
    words = tuple(device if word == "DEVICE" else word for word in words)
    code, out, err = call(monkeypatch, capsys, *words)
    assert code == 2
    assert said in err
    assert len(err.strip().splitlines()) == 1
    assert out == ""


def test_a_servo_that_is_not_there_is_one_line_and_code_1(
    device: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, err = call(monkeypatch, capsys, "bus", "set", "--port", device, "--id", "99")
    assert code == 1
    assert err.startswith("snakewalk: servo 99: ping: no answer at 1000000 baud; find it with")


@pytest.fixture
def robot_file(tmp_path: Path, line: OpenedLine) -> Path:
    """File of a robot of its own, and the fingerprint file of its servos as they are now."""
    path = tmp_path / "mine.toml"
    path.write_text('name = "mine"\njoint_axes = "yyyyyyyyyyyyyyyy"\n', encoding="utf-8")
    bank = line.bank
    known = {
        i: {n: int(bank[n][i - 1]) for n in FINGERPRINT if n in load_control_table("XM430-W350")}
        for i in range(1, 17)
    }
    FingerprintFile(path).write(known)
    return path


def test_the_doctor_shows_a_changed_zero_and_accepts_it_when_asked(
    device: str,
    line: OpenedLine,
    robot_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = FingerprintFile(robot_file)
    words = ("doctor", "--port", device, "--robot", str(robot_file))
    line.bank["Homing Offset"][2] = 100
    code, out, _ = call(monkeypatch, capsys, *words, "--json")
    found = {f["check"]: f for f in json.loads(out)["findings"]}["fingerprint"]
    assert (code, found["grade"]) == (1, "fail")
    assert "joint yaw_03 (ID 3): Homing Offset is 100, was 0" in found["found"]
    code, out, err = call(monkeypatch, capsys, *words, "--accept")
    assert code == 2  # nobody is there to be asked
    assert "joint yaw_03 (ID 3): Homing Offset: 0 -> 100" in out
    assert "add --yes" in err
    code, out, _ = call(monkeypatch, capsys, *words, "--accept", "--yes")
    assert code == 0
    assert (file.read() or {})[3]["Homing Offset"] == 100
    code, out, _ = call(monkeypatch, capsys, *words, "--accept", "--yes")
    assert "the servos are as in" in out


def test_the_doctor_accepts_nothing_for_a_shipped_robot(
    device: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("doctor", "--port", device, "--robot", "yaw16", "--accept", "--yes")
    code, _, err = call(monkeypatch, capsys, *words)
    assert code == 2
    assert "yaw16 has no fingerprint file" in err


def test_bus_set_updates_the_fingerprint_file(
    device: str,
    robot_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ("bus", "set", "--port", device, "--id", "16", "--yes", "--robot", str(robot_file))
    code, _, _ = call(monkeypatch, capsys, *words, "--new-id", "40", "--current-limit", "1.0")
    assert code == 0
    found = FingerprintFile(robot_file).read() or {}
    assert 16 not in found
    assert found[40]["Current Limit"] == round(1.0 / 2.69e-3)
