"""Several models on one bus: each answers from its own table, by its own rules."""

import dynamixel_sdk as sdk
import pytest

from snakewalk.config.errors import InputError
from snakewalk.drivers.protocol.packet import Instruction, ResultError
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from tests.helpers.bus import ALL, ask, group_params, write

KOCH = "1-2:XL430-W250,3-6:XL330-M288"


def koch() -> SimLine:
    line = bench_line(parse_chain(KOCH))
    assert isinstance(line, SimLine)
    return line


def test_broadcast_ping_tells_each_model() -> None:
    numbers, result = sdk.PacketHandler(2.0).broadcastPing(koch())
    assert result == sdk.COMM_SUCCESS
    assert {each: number for each, (number, _) in numbers.items()} == {
        **dict.fromkeys((1, 2), 1060),
        **dict.fromkeys((3, 4, 5, 6), 1200),
    }


def test_writes_are_judged_by_the_model() -> None:
    line = koch()
    assert write(line, 1, 11, 5, 1) == ResultError.DATA_RANGE  # no current in an XL430
    assert write(line, 3, 11, 5, 1) == 0
    assert write(line, 1, 44, 1500, 4) == ResultError.DATA_RANGE
    assert write(line, 3, 44, 1500, 4) == 0
    assert write(line, 3, 8, 7, 1) == ResultError.DATA_RANGE  # 330 models end at 4 Mbaud


@pytest.mark.parametrize("code", [Instruction.SYNC_READ, Instruction.FAST_SYNC_READ])
def test_group_reads_and_writes_run_over_all_models(code: int) -> None:
    line = koch()
    for servo in range(1, 7):
        assert write(line, servo, 64, 1, 1) == 0
    goals = b"".join(bytes((k,)) + (2048 + 100 * k).to_bytes(4, "little") for k in range(6, 0, -1))
    assert ask(line, ALL, Instruction.SYNC_WRITE, b"\x74\0\4\0" + goals) == []
    assert line.bank["Goal Position"].tolist() == [2048 + 100 * k for k in range(1, 7)]
    line.clock.advance(2.0)
    line.settle()
    answers = ask(line, ALL, code, group_params(132, 4, range(1, 7)))
    assert len(answers) == (6 if code == Instruction.SYNC_READ else 1)
    shown = line.bank["Present Position"]
    assert abs(shown - line.bank["Goal Position"]).max() < 60
    if code == Instruction.SYNC_READ:
        assert [int.from_bytes(a.params, "little") for a in answers] == shown.tolist()


@pytest.mark.parametrize(("servo", "model"), [(2, "XL430-W250"), (5, "XL330-M288")])
def test_each_servo_has_the_control_table_of_its_model(servo: int, model: str) -> None:
    alone = bench_line(parse_chain(f"{servo}:{model}"))
    (mixed,) = ask(koch(), servo, Instruction.READ, bytes((0, 0, 147, 0)))
    (single,) = ask(alone, servo, Instruction.READ, bytes((0, 0, 147, 0)))
    assert mixed == single


@pytest.mark.parametrize("servo", [1, 2, 3])
def test_indirect_data_of_one_servo_leaves_the_others_alone(servo: int) -> None:
    line = koch()
    assert write(line, servo, 168, 65, 2) == 0  # Indirect Address 1 points at the LED
    assert write(line, servo, 224, 1, 1) == 0
    assert line.bank["LED"].tolist() == [int(each == servo) for each in range(1, 7)]
    (status,) = ask(line, servo, Instruction.READ, bytes((224, 0, 1, 0)))
    assert status.params == b"\x01"


def test_wrong_chains_are_refused() -> None:
    with pytest.raises(InputError, match="names no model"):
        parse_chain("1-2:,3:XL330-M288")
    with pytest.raises(InputError, match="not on one bus"):
        bench_line(parse_chain("1:AX-12A,2:XL330-M288"))
    with pytest.raises(InputError, match="share an ID"):
        bench_line(parse_chain("1-3:XL430-W250,3:XL330-M288"))
