"""The fault language: every kind, by script, at its time, from its seed."""

import math
import tomllib
from pathlib import Path

import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.faults import FaultPlan, ServoFault
from snakewalk.config.loader import checked, load
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.protocol.packet import (
    ALERT,
    Instruction,
    InstructionPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from tests.helpers.bus import ALL, a_line, ask, exchange, group_params, read, send, write

READ_ALL = encode_instruction(
    InstructionPacket(ALL, Instruction.SYNC_READ, group_params(132, 4, range(1, 5)))
)
PING_2 = encode_instruction(InstructionPacket(2, Instruction.PING))


def scripted(text: str, joints: int = 4, **bench: object) -> SimLine:
    line = a_line(joints, **bench)
    FaultPlayer(line, checked(FaultPlan, tomllib.loads(text), "test"))
    return line


def fault(kind: str, **keys: object) -> str:
    shown = "".join(f"{key} = {value!r}\n" for key, value in keys.items())
    return f'[[fault]]\nkind = "{kind}"\n{shown}'.replace("True", "true").replace("(", "[")


def wait(line: SimLine, seconds: float) -> None:
    line.clock.advance(seconds)
    line.settle()


def replying_ids(line: SimLine) -> list[int]:
    return [status.servo_id for status in PacketParser().feed(exchange(line, READ_ALL))]


def test_noise_acts_in_its_window_on_its_servos() -> None:
    line = scripted(fault("drop", at_s=1.0, for_s=1.0, ids=[2, 3]))
    assert replying_ids(line) == [1, 2, 3, 4]
    wait(line, 1.0)
    assert replying_ids(line) == [1, 4]
    wait(line, 1.0)
    assert replying_ids(line) == [1, 2, 3, 4]


@pytest.mark.parametrize("kind", ["corrupt", "truncate"])
def test_damaged_answers_are_none(kind: str) -> None:
    line = scripted(fault(kind, ids=[2]))
    assert replying_ids(line) == [1, 3, 4]


def test_duplicates_come_twice() -> None:
    assert replying_ids(scripted(fault("duplicate", ids=[3]))) == [1, 2, 3, 3, 4]


def test_a_late_answer_comes_after_the_time_out_into_the_next_exchange() -> None:
    line = scripted(fault("late", ids=[2], for_s=0.01))
    assert send(line, PING_2) == []
    wait(line, 0.05)
    first, second = send(line, PING_2)
    assert first.servo_id == second.servo_id == 2


def test_delay_holds_up_what_is_behind() -> None:
    times_s = []
    for text in ("", fault("delay", by_s=0.003, ids=[1])):
        line = scripted(text)
        line.write(READ_ALL)
        line.read_until(4 * 15, 1.0)
        times_s.append(line.clock.now_s())
    assert times_s[1] - times_s[0] == pytest.approx(0.003, abs=1e-6)


def test_a_damaged_question_is_not_obeyed() -> None:
    line = scripted(fault("corrupt", of="questions", at_s=0.5))
    wait(line, 0.5)
    assert ask(line, 1, Instruction.WRITE, bytes((65, 0, 1))) == []
    assert line.bank["LED"][0] == 0


def test_noise_is_seeded_and_as_frequent_as_asked() -> None:
    def run(seed: int) -> bytes:
        line = scripted(f"seed = {seed}\n" + fault("drop", chance=0.1))
        return b"".join(exchange(line, READ_ALL) for _ in range(100))

    first = run(1)
    assert first == run(1)
    assert first != run(2)
    assert 330 <= len(first) / 15 <= 385


def test_a_mute_servo_obeys() -> None:
    line = scripted(fault("mute", ids=[2]))
    wait(line, 0.01)
    assert ask(line, 2, Instruction.WRITE, bytes((65, 0, 1))) == []
    assert line.bank["LED"].tolist() == [0, 1, 0, 0]


def test_a_stuck_servo_pushes_until_it_trips() -> None:
    line = scripted(fault("stuck", ids=[1], at_s=1.0, for_s=4.0), joints=2)
    for servo in (1, 2):
        write(line, servo, 64, 1, 1)
    wait(line, 1.0)
    for servo in (1, 2):
        write(line, servo, 116, 3500, 4)
    wait(line, 0.5)
    assert abs(read(line, 1, 132, 4) - 2048) < 30
    assert read(line, 2, 132, 4) > 2500
    assert read(line, 1, 124, 2) == 885
    assert read(line, 1, 126, 2) > 700
    wait(line, 2.0)
    assert read(line, 1, 70, 1) == 0x20
    assert read(line, 1, 64, 1) == 0
    wait(line, 2.0)
    ask(line, 1, Instruction.REBOOT)
    write(line, 1, 64, 1, 1)
    write(line, 1, 116, 2500, 4)
    wait(line, 1.0)
    assert read(line, 1, 132, 4) == pytest.approx(2500, abs=25)


def test_a_brown_out_silences_lets_go_and_forgets_the_turns() -> None:
    line = scripted(fault("brown_out", ids=[1], at_s=1.0, for_s=0.5), joints=2)
    for servo in (1, 2):
        write(line, servo, 11, 4, 1)
        write(line, servo, 64, 1, 1)
    line.firmware.plant.position_rad[:] += math.tau
    write(line, 1, 116, 2048 + 4096, 4)
    write(line, 2, 116, 2048 + 4096, 4)
    before = read(line, 1, 132, 4)
    assert before > 4096
    wait(line, 1.0)
    assert ask(line, 1, Instruction.PING) == []
    assert line.firmware.drive.torque_on.tolist() == [0.0, 1.0]
    wait(line, 0.5)
    assert read(line, 1, 132, 4) == pytest.approx(before % 4096, abs=5)
    assert (read(line, 1, 64, 1), read(line, 1, 11, 1)) == (0, 4)
    assert read(line, 2, 132, 4) == pytest.approx(before, abs=5)


@pytest.mark.parametrize(
    ("kind", "bits"),
    [("overload", 0x20), ("overheating", 0x04), ("encoder", 0x08), ("shock", 0x10)],
)
def test_trips_show_and_switch_off_what_shutdown_names(kind: str, bits: int) -> None:
    line = scripted(fault(kind, ids=[2], at_s=0.5))
    for servo in (1, 2):
        write(line, servo, 64, 1, 1)
    wait(line, 0.5)
    assert ask(line, 2, Instruction.PING)[0].error == ALERT
    assert read(line, 2, 70, 1) == bits
    assert read(line, 2, 64, 1) == int(not bits & 52)
    assert read(line, 1, 64, 1) == 1


def test_heat_trips_when_it_is_seen() -> None:
    line = scripted(fault("heat", ids=[3], celsius=95.0))
    write(line, 3, 64, 1, 1)
    wait(line, 0.1)
    assert read(line, 3, 146, 1) == 95
    assert read(line, 3, 70, 1) & 0x04


def test_a_sagging_supply_is_a_voltage_error_and_a_collapse_a_shock() -> None:
    line = scripted(fault("supply", volts=9.0, for_s=0.5) + fault("supply", volts=4.0, at_s=1.0))
    write(line, 1, 64, 1, 1)
    wait(line, 0.2)
    assert read(line, 1, 70, 1) == 0x01
    wait(line, 0.5)
    assert read(line, 1, 144, 2) == 120
    wait(line, 0.5)
    assert read(line, 1, 70, 1) & 0x10


def test_two_servos_with_one_id_garble_what_differs() -> None:
    line = scripted(fault("clash", id=3, takes=2, for_s=1.0))
    line.bank["Moving Threshold"][2] = 99
    wait(line, 0.01)
    assert [status.servo_id for status in send(line, PING_2)] == [2]  # the same twice is once
    assert ask(line, 2, Instruction.READ, bytes((24, 0, 4, 0))) == []
    assert ask(line, 3, Instruction.PING) == []
    wait(line, 1.0)
    assert read(line, 2, 24, 4) == 10


def test_two_servos_exchange_their_ids_and_get_them_back() -> None:
    line = scripted(fault("exchange", id=3, takes=2, for_s=1.0))
    wait(line, 0.01)
    assert line.ids() == [1, 3, 2, 4]
    assert replying_ids(line) == [1, 2, 3, 4]
    wait(line, 1.0)
    assert line.ids() == [1, 2, 3, 4]


def test_another_program_writes_to_a_register() -> None:
    line = scripted(fault("write", ids=[2], register="Goal PWM", value=0, at_s=0.5))
    assert read(line, 2, 100, 2) == 885
    wait(line, 0.5)
    assert (read(line, 1, 100, 2), read(line, 2, 100, 2)) == (885, 0)


@pytest.mark.parametrize(
    ("register", "value", "said"),
    [
        ("Goal Speed", 1, "fault.0.write: servo 2 has no register Goal Speed"),
        ("Torque Enable", 300, "Torque Enable of servo 2 holds 0 to 255, not 300"),
    ],
)
def test_a_write_that_cannot_be_is_refused(register: str, value: int, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        scripted(fault("write", ids=[2], register=register, value=value))


def test_a_cable_out_in_mid_chain_takes_all_behind_it() -> None:
    line = scripted(fault("unplug", behind=2, at_s=0.5, for_s=0.5))
    wait(line, 0.5)
    assert replying_ids(line) == [1, 2]
    assert line.firmware.powered.tolist() == [True, True, False, False]
    wait(line, 0.5)
    assert replying_ids(line) == [1, 2, 3, 4]


def test_a_stalled_host_sends_late() -> None:
    line = scripted(fault("stall", at_s=0.5, for_s=0.25))
    wait(line, 0.5)
    start_s = line.clock.now_s()
    line.write(PING_2)
    assert line.clock.now_s() - start_s == pytest.approx(0.25, abs=0.15)
    assert line.clock.now_s() > start_s


def test_a_port_vanishes_and_comes_back() -> None:
    line = scripted(fault("port", at_s=0.5, for_s=0.5))
    assert replying_ids(line) == [1, 2, 3, 4]
    line.write(READ_ALL)
    with pytest.raises(PortError, match="vanished"):
        line.read_until(999, 0.7)
    assert not line.openPort()
    wait(line, 0.5)
    with pytest.raises(PortError, match="closed"):
        line.write(PING_2)
    assert line.openPort()
    assert len(send(line, PING_2)) == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[fault]]\nkind = 'fire'", "kind"),
        ("[[fault]]\nkind = 'drop'\nchance = 2.0", "chance"),
        ("[[fault]]\nkind = 'drop'\nby_s = 2.0", "has no 'by_s'"),
        ("[[fault]]\nkind = 'mute'", "ids: is required"),
        ("[[fault]]\nkind = 'mute'\nids = [253]", "must be at most 252 \\(got 253\\)"),
        ("sed = 1", "sed: unknown key"),
        ("[[fault", "not TOML"),
    ],
)
def test_a_wrong_file_is_one_clear_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "faults.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=said) as caught:
        load(path, FaultPlan)
    assert all(line.startswith(str(path)) for line in caught.value.faults)


def test_a_servo_that_is_not_there_is_named() -> None:
    with pytest.raises(ConfigError, match=r"fault.0.mute: no servo has ID 9; the bus has 1, 2"):
        scripted(fault("mute", ids=[9]), joints=2)


def test_a_kind_that_the_player_does_not_know_is_not_played_as_another() -> None:
    unknown = ServoFault.model_construct(kind="melt", ids=(1,), at_s=0.0)
    line = a_line(2)
    with pytest.raises(AssertionError, match="melt"):
        FaultPlayer(line, FaultPlan.model_construct(seed=0, fault=(unknown,)))


GOALS = encode_instruction(
    InstructionPacket(
        ALL,
        Instruction.SYNC_WRITE,
        bytes((116, 0, 4, 0)) + b"".join(bytes((k, 0, 9, 0, 0)) for k in range(1, 5)),
    )
)
GAINS = encode_instruction(
    InstructionPacket(
        ALL,
        Instruction.SYNC_WRITE,
        bytes((84, 0, 2, 0)) + b"".join(bytes((k, 77, 0)) for k in range(1, 5)),
    )
)


def test_a_deaf_servo_ignores_sync_writes_only() -> None:
    line = scripted(fault("deaf", ids=[2], at_s=0.1, for_s=1.0))
    wait(line, 0.2)
    was = line.bank["Goal Position"][1], line.bank["Position P Gain"][1]
    exchange(line, GOALS)
    exchange(line, GAINS)
    assert line.bank["Goal Position"].tolist() == [2304, was[0], 2304, 2304]
    assert line.bank["Position P Gain"].tolist() == [77, was[1], 77, 77]
    assert write(line, 2, 84, 77, 2) == 0
    assert line.bank["Position P Gain"][1] == 77
    wait(line, 1.0)
    exchange(line, GOALS)
    assert line.bank["Goal Position"].tolist() == [2304] * 4


def test_an_alert_without_an_error_is_set_while_it_lasts() -> None:
    line = scripted(fault("alert", ids=[3], at_s=0.1, for_s=1.0))
    for pause_s, alerts in ((0.0, []), (0.2, [3]), (1.0, [])):
        wait(line, pause_s)
        replies = PacketParser().feed(exchange(line, READ_ALL))
        assert [each.servo_id for each in replies if each.error & ALERT] == alerts
        (status,) = ask(line, 3, Instruction.READ, bytes((70, 0, 1, 0)))
        assert status.params == b"\0"
        assert bool(status.error & ALERT) == bool(alerts)


@pytest.mark.parametrize("value", [None, 0])
def test_a_dead_sensor_reports_a_constant_value(value: int | None) -> None:
    keys = {} if value is None else {"value": value}
    line = scripted(
        fault("reading", ids=[1], register="Present Temperature", at_s=0.1, for_s=1.0, **keys)
        + fault("heat", ids=[1, 2], celsius=60.0, at_s=0.2)
    )
    wait(line, 0.3)
    assert line.shown("Present Temperature")[:2].tolist() == [25 if value is None else 0, 60]
    wait(line, 1.0)
    assert line.shown("Present Temperature")[0] == line.shown("Present Temperature")[1]


def test_a_register_is_written_again_and_again() -> None:
    line = scripted(
        fault("write", ids=[1], register="Goal PWM", value=5, at_s=0.1, every_s=0.01, for_s=0.5)
    )
    for pause_s, still_s, expected in ((0.0, 0.105, 5), (0.0, 0.2, 5), (0.4, 0.1, 700)):
        wait(line, pause_s)
        line.bank["Goal PWM"][0] = 700
        wait(line, still_s)
        assert line.bank["Goal PWM"][0] == expected
