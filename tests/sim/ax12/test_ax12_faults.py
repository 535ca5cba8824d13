"""Fault files on a bus of AX-12A: every kind, on Protocol 1.0 packets and the model's registers."""

import tomllib
from pathlib import Path

import dynamixel_sdk as sdk
import numpy as np
import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import checked
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.protocol.protocol1 import Error1, frame
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from tests.helpers.command import snakewalk
from tests.sim.faults.test_faults import fault

OK = (sdk.COMM_SUCCESS, 0)
PH = sdk.PacketHandler(1.0)
TIMEOUT = sdk.COMM_RX_TIMEOUT
TORQUE, GOAL, LIMIT, POSITION, LOAD, VOLTS, CELSIUS = 24, 30, 34, 36, 40, 42, 43


def scripted(text: str, servos: str = "1-3") -> Ax12Line:
    line = bench_line(parse_chain(f"{servos}:AX-12A"))
    assert isinstance(line, Ax12Line)
    line.servos["Return Delay Time"][:] = 0
    FaultPlayer(line, checked(FaultPlan, tomllib.loads(text), "test"))
    return line


def wait(line: Ax12Line, seconds: float) -> None:
    line.clock.advance(seconds)
    line.settle()


def ask(line: Ax12Line, servo_id: int, code: int = 1, params: bytes = b"") -> bytes:
    """All bytes that come within 20 ms."""
    line.write(frame(servo_id, code, params))
    return line.read_until(999, line.clock.now_s() + 0.02)


def word(line: Ax12Line, servo_id: int, address: int) -> int:
    value, result, _ = PH.read2ByteTxRx(line, servo_id, address)
    assert result == sdk.COMM_SUCCESS
    return value


def error(line: Ax12Line, servo_id: int) -> int:
    answer = ask(line, servo_id)
    assert answer == frame(servo_id, answer[4])
    return answer[4]


def answering(line: Ax12Line) -> list[int]:
    return [each for each in (1, 2, 3) if ask(line, each) == frame(each, 0)]


@pytest.mark.parametrize("kind", ["drop", "corrupt", "truncate"])
def test_noise_spoils_the_answers_of_the_servos_named(kind: str) -> None:
    line = scripted(fault(kind, ids=[2], at_s=0.5, for_s=0.5))
    assert answering(line) == [1, 2, 3]
    wait(line, 0.5)
    assert answering(line) == [1, 3]
    wait(line, 0.5)
    assert answering(line) == [1, 2, 3]


def test_duplicate_delay_and_late() -> None:
    pong = frame(2, 0)
    assert ask(scripted(fault("duplicate", ids=[2])), 2) == pong * 2
    line = scripted(fault("late", ids=[2], for_s=0.01))
    assert ask(line, 2) == b""
    wait(line, 0.05)
    assert ask(line, 2) == pong * 2
    times_s = []
    for text in ("", fault("delay", by_s=0.003, ids=[2])):
        line = scripted(text)
        line.write(frame(2, 1))
        line.read_until(6, 1.0)
        times_s.append(line.clock.now_s())
    assert times_s[1] - times_s[0] == pytest.approx(0.003, abs=1e-6)


def test_a_damaged_question_is_not_obeyed() -> None:
    line = scripted(fault("truncate", of="questions"))
    assert ask(line, 1, 3, bytes((25, 1))) == b""
    assert line.servos["LED"].tolist() == [0, 0, 0]


def test_a_mute_servo_obeys() -> None:
    line = scripted(fault("mute", ids=[2]))
    wait(line, 0.01)
    assert ask(line, 2, 3, bytes((25, 1))) == b""
    assert line.servos["LED"].tolist() == [0, 1, 0]


@pytest.mark.slow
def test_a_stuck_servo_pushes_until_it_trips_and_works_again_with_a_torque_limit() -> None:
    line = scripted(fault("stuck", ids=[1], at_s=0.5, for_s=4.0))
    wait(line, 0.5)
    for servo in (1, 2):
        assert PH.write2ByteTxRx(line, servo, GOAL, 900) == OK
    wait(line, 0.5)
    assert abs(word(line, 1, POSITION) - 512) < 10
    assert word(line, 2, POSITION) > 600
    assert word(line, 1, LOAD) == 1023
    wait(line, 1.0)
    assert error(line, 1) == Error1.OVERLOAD
    assert error(line, 2) == 0
    assert (word(line, 1, LIMIT), line.servos["Torque Enable"][0]) == (0, 0)
    wait(line, 3.0)
    assert error(line, 1) == Error1.OVERLOAD  # nobody has dealt with it
    assert PH.write2ByteTxRx(line, 1, LIMIT, 1023) == OK
    assert PH.write2ByteTxRx(line, 1, GOAL, 700) == OK
    wait(line, 1.5)
    assert word(line, 1, POSITION) == pytest.approx(700, abs=8)
    assert error(line, 1) == 0


def test_a_brown_out_silences_lets_go_and_starts_anew() -> None:
    line = scripted(fault("brown_out", ids=[1], at_s=1.0, for_s=0.5))
    assert PH.write2ByteTxRx(line, 1, 8, 1000) == OK
    for servo in (1, 2):
        assert PH.write2ByteTxRx(line, servo, GOAL, 600) == OK
    assert PH.write2ByteTxRx(line, 1, 32, 300) == OK
    assert PH.write1ByteTxRx(line, 1, 47, 1) == OK
    wait(line, 1.0)
    assert answering(line) == [2, 3]
    assert line.servos.drive.torque_on.tolist() == [0.0, 1.0, 0.0]
    wait(line, 0.5)
    registers = {name: int(line.servos[name][0]) for name in ("Torque Enable", "Lock")}
    assert registers == {"Torque Enable": 0, "Lock": 0}
    assert (word(line, 1, 8), word(line, 1, 32)) == (1000, 0)  # EEPROM stays, RAM does not
    assert word(line, 1, GOAL) == pytest.approx(600, abs=5)  # where it is
    assert line.servos["Torque Enable"].tolist() == [0, 1, 0]


def test_reboot_takes_the_torque_limit_from_the_eeprom() -> None:
    line = scripted(fault("reboot", ids=[2], at_s=0.5))
    assert PH.write2ByteTxRx(line, 2, 14, 500) == OK
    assert PH.write1ByteTxRx(line, 2, TORQUE, 1) == OK
    wait(line, 0.5)
    assert (word(line, 2, LIMIT), line.servos["Torque Enable"][1]) == (500, 0)


@pytest.mark.parametrize(
    ("kind", "bit", "off"),
    [
        ("overload", Error1.OVERLOAD, True),
        ("overheating", Error1.OVERHEATING, True),
        ("voltage", Error1.VOLTAGE, False),  # not in the initial Shutdown(18), 36
    ],
)
def test_alarms_are_in_every_answer_and_shut_down_as_the_register_says(
    kind: str, bit: int, off: bool
) -> None:
    line = scripted(fault(kind, ids=[2], at_s=0.5))
    for servo in (1, 2):
        assert PH.write1ByteTxRx(line, servo, TORQUE, 1) == OK
    wait(line, 0.6)
    assert error(line, 1) == 0
    assert PH.read1ByteTxRx(line, 2, TORQUE) == (int(not off), sdk.COMM_SUCCESS, bit)
    assert PH.write1ByteTxRx(line, 2, 25, 1) == (sdk.COMM_SUCCESS, bit)
    assert line.servos["Torque Limit"].tolist() == [1023, 0 if off else 1023, 1023]
    assert PH.write2ByteTxRx(line, 2, LIMIT, 800) == OK  # resolved, and set to something else


def test_shutdown_18_decides() -> None:
    line = scripted(fault("overload", ids=[1], at_s=0.5) + fault("voltage", ids=[2], at_s=0.5))
    for servo, mask in ((1, 0), (2, 1)):
        assert PH.write1ByteTxRx(line, servo, 18, mask) == OK
        assert PH.write1ByteTxRx(line, servo, TORQUE, 1) == OK
    wait(line, 0.6)
    assert line.servos["Torque Enable"].tolist() == [1, 0, 0]
    assert [error(line, servo) for servo in (1, 2)] == [Error1.OVERLOAD, Error1.VOLTAGE]


def test_heat_is_an_alarm_until_it_is_gone_and_dealt_with() -> None:
    line = scripted(fault("heat", ids=[3], celsius=90.0))
    wait(line, 0.1)
    assert PH.read1ByteTxRx(line, 3, CELSIUS)[0] == 90
    assert error(line, 3) == Error1.OVERHEATING
    assert PH.write2ByteTxRx(line, 3, LIMIT, 1023)[0] == sdk.COMM_SUCCESS
    wait(line, 0.1)
    assert word(line, 3, LIMIT) == 0  # still hot
    line.servos.protection.heat(np.array([2]), 30.0)
    assert PH.write2ByteTxRx(line, 3, LIMIT, 1023)[0] == sdk.COMM_SUCCESS
    wait(line, 0.1)
    assert (word(line, 3, LIMIT), error(line, 3)) == (1023, 0)


def test_a_low_supply_shows_while_it_lasts_on_the_servos_named_or_on_all() -> None:
    some = fault("supply", volts=5.5, ids=[2], at_s=0.5, for_s=0.5)
    line = scripted(some + fault("supply", volts=15.0, at_s=1.5, for_s=0.5))
    seen = []
    for _ in range(4):
        volts = [PH.read1ByteTxRx(line, servo, VOLTS)[0] for servo in (1, 2, 3)]
        seen.append((volts, [error(line, servo) for servo in (1, 2, 3)]))
        wait(line, 0.6 if not seen[1:] else 0.5)
    assert seen == [
        ([120, 120, 120], [0, 0, 0]),
        ([120, 55, 120], [0, Error1.VOLTAGE, 0]),
        ([120, 120, 120], [0, 0, 0]),
        ([150, 150, 150], [Error1.VOLTAGE] * 3),
    ]


def test_two_servos_with_one_id_garble_what_differs() -> None:
    line = scripted(fault("clash", id=3, takes=2, at_s=0.1, for_s=1.0))
    line.servos["LED"][2] = 1
    wait(line, 0.1)
    assert ask(line, 2) == frame(2, 0)  # the same twice is once
    assert PH.read1ByteTxRx(line, 2, 25)[1] != sdk.COMM_SUCCESS
    assert line.collisions == 1
    assert ask(line, 3) == b""
    wait(line, 1.0)
    assert answering(line) == [1, 2, 3]


def test_a_cable_out_in_mid_chain_takes_all_behind_it() -> None:
    line = scripted(fault("unplug", behind=1, at_s=0.5, for_s=0.5))
    wait(line, 0.5)
    assert answering(line) == [1]
    wait(line, 0.5)
    assert answering(line) == [1, 2, 3]


def test_a_stalled_host_and_a_port_that_vanishes() -> None:
    line = scripted(fault("stall", at_s=0.5, for_s=0.25) + fault("port", at_s=1.0, for_s=0.5))
    wait(line, 0.5)
    assert ask(line, 1) == frame(1, 0)
    assert line.clock.now_s() >= 0.75
    line.clock.sleep_until_s(1.0)
    with pytest.raises(PortError, match="vanished"):
        ask(line, 1)
    wait(line, 0.5)
    assert line.openPort()
    assert answering(line) == [1, 2, 3]


def test_the_same_seed_gives_the_same_bytes() -> None:
    def run(seed: int) -> bytes:
        line = scripted(f"seed = {seed}\n" + fault("corrupt", chance=0.3))
        return b"".join(ask(line, 1 + k % 3) for k in range(60))

    assert run(1) == run(1)
    assert run(1) != run(2)


@pytest.mark.parametrize("kind", ["encoder", "shock"])
def test_what_the_model_cannot_detect_is_refused(kind: str) -> None:
    said = f"faults: fault.0.{kind}: servo 1 detects overload, overheating, voltage only"
    with pytest.raises(ConfigError) as caught:
        scripted(fault(kind, ids=[1]))
    assert caught.value.faults == (said,)


def test_serve_refuses_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "faults.toml"
    path.write_text(fault("encoder", ids=[5]))
    words = ("bus", "serve", "--servos", "5:AX-12A", "--faults", str(path))
    done = snakewalk(*words)
    assert done.returncode == 2
    assert done.stderr.strip().endswith(
        f"{path}: fault.0.encoder: servo 5 detects overload, overheating, voltage only"
    )
    assert len(done.stderr.strip().splitlines()) == 1
