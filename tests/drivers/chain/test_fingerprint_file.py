"""The file that knows how servos were at the last start."""

from pathlib import Path

import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.fingerprint_file import FingerprintFile, user_file
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import ChainError
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ROBOT = RobotConfig(name="four", joint_axes="yyyy")


@pytest.fixture
def line() -> SimLine:
    return SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(4))


@pytest.fixture
def file(tmp_path: Path) -> FingerprintFile:
    return FingerprintFile(tmp_path / "mine.toml")


def start(line: SimLine, file: FingerprintFile, robot: RobotConfig = ROBOT) -> list[str]:
    """Events of a start, after which torque is off again."""
    chain = ServoChain(DynamixelBus(line), robot, fingerprint_file=file)
    events: list[str] = []
    chain.on_event = events.append
    chain.enable()
    chain.disable()
    return [each for each in events if each.startswith(str(file.path))]


def test_a_missing_file_is_created_and_reported_once(line: SimLine, file: FingerprintFile) -> None:
    assert start(line, file) == [f"{file.path}: created with the settings of 4 servos"]
    assert file.path.name == "mine.servos.toml"
    found = file.read()
    assert found is not None
    assert sorted(found) == [1, 2, 3, 4]
    assert found[1]["Shutdown"] == 52
    assert start(line, file) == []


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize(
    ("register", "value", "said"),
    [
        ("Homing Offset", 100, "Homing Offset is 100, was 0: its zero has moved by +0.15 rad"),
        ("Drive Mode", 1, "Drive Mode is 1, was 0: its direction is reversed"),
        ("Current Limit", 500, "Current Limit is 500, was 1193"),
        ("PWM Limit", 500, "PWM Limit is 500, was 885"),
        ("Velocity Limit", 900, "Velocity Limit is 900, was 200"),
        ("Temperature Limit", 100, "Temperature Limit is 100, was 80"),
        ("Min Voltage Limit", 100, "Min Voltage Limit is 100, was 95"),
        ("Max Voltage Limit", 150, "Max Voltage Limit is 150, was 160"),
    ],
)
def test_a_servo_that_differs_from_the_last_start_is_refused_before_torque(
    line: SimLine, file: FingerprintFile, register: str, value: int, said: str
) -> None:
    """A zero that changed while torque was off was accepted by the next start."""
    start(line, file)
    line.bank[register][2] = value
    line.firmware.apply_registers()
    with pytest.raises(ChainError) as raised:
        start(line, file)
    (text,) = raised.value.faults
    assert text.startswith(f"{file.path}: joint yaw_03 (ID 3): {said}")
    assert "snakewalk doctor --accept --robot" in text
    assert not line.bank["Torque Enable"].any()
    assert file.read() != {}


def test_limits_that_follow_the_robots_file_are_no_fault(
    line: SimLine, file: FingerprintFile
) -> None:
    start(line, file)
    narrow = ROBOT.model_copy(update={"yaw_limit_rad": 1.0})
    (event,) = start(line, file, narrow)
    assert event.endswith("updated: servos were added, or limits follow the robot's file")
    assert start(line, file, narrow) == []


def test_a_servo_that_is_new_is_added(line: SimLine, file: FingerprintFile) -> None:
    start(line, file)
    known = file.read()
    assert known is not None
    file.write({i: each for i, each in known.items() if i != 4})
    assert start(line, file) == [
        f"{file.path}: updated: servos were added, or limits follow the robot's file"
    ]
    assert file.read() == known


def test_a_file_of_an_older_version_is_reported_and_completed(
    line: SimLine, file: FingerprintFile
) -> None:
    """A Temperature Limit of 100 C was accepted: the file did not hold it."""
    start(line, file)
    known = file.read()
    assert known is not None
    added = ("Temperature Limit", "Velocity Limit")
    file.write({i: {n: v for n, v in each.items() if n not in added} for i, each in known.items()})
    line.bank["Temperature Limit"][2] = 79
    assert start(line, file) == [
        f"{file.path}: had no Velocity Limit, Temperature Limit; completed with the present values"
    ]
    line.bank["Temperature Limit"][2] = 80
    with pytest.raises(ChainError, match="Temperature Limit is 80, was 79"):
        start(line, file)


@pytest.mark.parametrize("text", ["not toml", "x = 1\n", "[a]\n", '[1]\n"Homing Offset" = "0"\n'])
def test_a_broken_file_is_refused_with_its_remedy(
    line: SimLine, file: FingerprintFile, text: str
) -> None:
    file.path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"is not a fingerprint file: .*; delete it"):
        start(line, file)


def test_a_folder_that_cannot_be_written_is_reported(
    line: SimLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = FingerprintFile(tmp_path / "mine.toml")

    def refuse(part: object, path: object) -> None:
        raise PermissionError("read-only")

    monkeypatch.setattr("os.replace", refuse)
    (event,) = start(line, file)
    assert "cannot be written: read-only" in event


def test_a_shipped_robot_has_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert user_file("alternating16") is None
    assert user_file("mine.toml") is None
    (tmp_path / "mine.toml").write_text("", encoding="utf-8")
    assert user_file("mine.toml") == Path("mine.toml")
