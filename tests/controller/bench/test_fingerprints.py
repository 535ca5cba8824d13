"""Fingerprints on the bench: read on every port, compared with the file, kept after a change."""

from pathlib import Path

import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.bench.fingerprints import (
    differences,
    fingerprint_file,
    fingerprint_finding,
    note_changes,
    read_all,
    write_fingerprints,
)
from snakewalk.controller.bench.port_lines import PortLines
from snakewalk.controller.bench.servo_settings import SettingChange
from snakewalk.drivers.chain.fingerprint_file import FingerprintFile
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ROBOT = RobotConfig(name="four", joint_axes="yyyy")
KNOWN = {servo_id: {"Homing Offset": 0, "Shutdown": 52} for servo_id in ROBOT.servo_ids}


@pytest.fixture
def file(tmp_path: Path) -> FingerprintFile:
    return FingerprintFile(tmp_path / "mine.toml")


class Line(SimLine):
    """A simulated line with the property of opened ports that the bench reads."""

    latency_s = 0.004


def test_servos_of_all_ports_are_read_and_a_silent_one_is_left_out() -> None:
    lines = [Line(ServoBank(ids), BenchPlant(len(ids))) for ids in ([1, 2], [3])]
    ports = PortLines("A,B", ((lines[0], (1, 2)), (lines[1], (3, 4))))
    found = read_all(ports, ROBOT)
    assert sorted(found) == [1, 2, 3]
    assert found[1]["Shutdown"] == 52
    one = Line(ServoBank(ROBOT.servo_ids), BenchPlant(4))
    assert sorted(read_all(PortLines("A", ((one, None),)), ROBOT)) == [1, 2, 3, 4]


def test_a_shipped_robot_has_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--accept: yaw16 has no fingerprint file; name"):
        fingerprint_file("yaw16", "--accept")
    mine = tmp_path / "mine.toml"
    mine.write_text('name = "mine"\n')
    assert fingerprint_file(str(mine), "--accept").path == tmp_path / "mine.servos.toml"


def test_the_finding_of_a_comparison(file: FingerprintFile) -> None:
    assert fingerprint_finding(file, ROBOT, KNOWN) is None
    file.write(KNOWN)
    same = fingerprint_finding(file, ROBOT, KNOWN)
    assert same is not None
    assert (same.grade, same.found) == ("ok", f"the servos are as in {file.path}")
    more = {servo_id: {**values, "PWM Limit": 885} for servo_id, values in KNOWN.items()}
    lacking = fingerprint_finding(file, ROBOT, more)
    assert lacking is not None
    assert (lacking.grade, lacking.found) == (
        "warn",
        f"{file.path} has no PWM Limit: not compared",
    )
    moved = fingerprint_finding(file, ROBOT, more | {2: {"Homing Offset": 100, "PWM Limit": 885}})
    assert moved is not None
    assert moved.grade == "fail"
    assert "Homing Offset is 100, was 0" in moved.found
    assert "--accept" in moved.remedy


def test_only_registers_that_differ_are_listed() -> None:
    found = {1: {"Homing Offset": 0, "Shutdown": 53}, 9: {"Shutdown": 1}}
    assert differences(ROBOT, KNOWN, found) == ["joint yaw_01 (ID 1): Shutdown: 52 -> 53"]
    assert differences(ROBOT, {}, {2: {"Shutdown": 5}}) == [
        "joint yaw_02 (ID 2): Shutdown: unknown -> 5"
    ]


def test_a_change_that_was_meant_goes_into_the_file(file: FingerprintFile) -> None:
    write_fingerprints(file.path.with_name("mine.toml"), KNOWN)
    made = [SettingChange("Shutdown", 52, 21, ""), SettingChange("LED", 0, 1, "")]
    assert note_changes(file, 2, [*made, SettingChange("ID", 2, 7, "")])
    known = file.read()
    assert known is not None
    assert sorted(known) == [1, 3, 4, 7]
    assert known[7] == {"Homing Offset": 0, "Shutdown": 21}
    assert not note_changes(file, 2, made)
    assert file.read() == known
