"""What holds on any bus of Protocol 2.0, whether its servos are of one model or of several."""

import tomllib

import dynamixel_sdk as sdk
import numpy as np
import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import checked
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.drivers.protocol.packet import ALERT, Instruction, ResultError, StatusPacket
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from snakewalk.sim.servo.motor import MOTORS
from snakewalk.sim.servo.protection import ALARMS
from tests.helpers.bus import ALL, ask, exchange, goals, group_params, read, write
from tests.sim.faults.test_faults import fault, wait

BUSES = (
    "1-4",
    "1-4:XL330-M288",
    "1-2:XL430-W250,3-4:XL330-M288",
    "1:XM430-W350,2-3:XL330-M288,4:XM430-W350",
)
IDS = (1, 2, 3, 4)
PH = sdk.PacketHandler(2.0)
OK = (sdk.COMM_SUCCESS, 0)


@pytest.fixture(params=BUSES)
def servos(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def line(servos: str) -> SimLine:
    return make(servos)


def make(servos: str, faults: str = "") -> SimLine:
    line = bench_line(parse_chain(servos))
    assert isinstance(line, SimLine)
    line.bank["Return Delay Time"][:] = 0
    line.refresh_ids()
    FaultPlayer(line, checked(FaultPlan, tomllib.loads(faults), "test"))
    return line


def models(servos: str) -> list[str]:
    return list(parse_chain(servos).models)


def of_each(answers: list[StatusPacket]) -> list[int]:
    return [answer.servo_id for answer in answers]


# instructions


def test_broadcast_ping_finds_all_with_their_models(line: SimLine, servos: str) -> None:
    found, result = PH.broadcastPing(line)
    assert result == sdk.COMM_SUCCESS
    numbers = [bench_line(parse_chain(f"1:{m}")).shown("Model Number")[0] for m in models(servos)]
    assert {each: number for each, (number, _) in found.items()} == dict(
        zip(IDS, numbers, strict=True)
    )


def test_broadcast_reg_write_and_action_reach_all(line: SimLine) -> None:
    assert ask(line, ALL, Instruction.REG_WRITE, bytes((65, 0, 1))) == []
    assert line.shown("Registered Instruction").tolist() == [1] * 4
    assert line.shown("LED").tolist() == [0] * 4
    assert ask(line, ALL, Instruction.ACTION) == []
    assert line.shown("LED").tolist() == [1] * 4
    assert line.shown("Registered Instruction").tolist() == [0] * 4


def test_broadcast_reboot_and_clear(line: SimLine) -> None:
    for servo in IDS:
        write(line, servo, 11, 4, 1)
    line.firmware.advance(line.clock.now_s())
    assert ask(line, ALL, Instruction.WRITE, bytes((64, 0, 1))) == []
    assert line.shown("Torque Enable").tolist() == [1] * 4
    assert ask(line, ALL, Instruction.REBOOT) == []
    assert line.shown("Torque Enable").tolist() == [0] * 4
    assert line.shown("Operating Mode").tolist() == [4] * 4
    line.firmware.protection.detect(np.arange(4), 0x20)
    assert ask(line, ALL, Instruction.CLEAR, b"\x02ERCL") == []
    assert line.shown("Hardware Error Status").tolist() == [0] * 4


@pytest.mark.parametrize("option", [0x01, 0x02])
def test_broadcast_factory_reset_keeps_ids(line: SimLine, option: int) -> None:
    for servo in IDS:
        write(line, servo, 31, 50, 1)
    ask(line, ALL, Instruction.FACTORY_RESET, bytes((option,)))
    assert line.shown("ID").tolist() == [1, 2, 3, 4]
    assert line.shown("Baud Rate").tolist() == [3 if option == 0x02 else 1] * 4
    assert (line.shown("Temperature Limit") != 50).all()


@pytest.mark.parametrize("fast", [False, True])
def test_bulk_read_takes_another_block_of_each(line: SimLine, fast: bool) -> None:
    for servo in IDS:
        write(line, servo, 12, 100 + servo, 1)
    blocks = {1: (7, 1), 2: (12, 1), 3: (0, 7), 4: (132, 4)}
    params = b"".join(
        bytes((each, address, 0, length, 0)) for each, (address, length) in blocks.items()
    )
    code = Instruction.FAST_BULK_READ if fast else Instruction.BULK_READ
    answers = ask(line, ALL, code, params)
    table = line.bank.table
    wanted = [table[k, a : a + n].tobytes() for k, (a, n) in enumerate(blocks.values())]
    if fast:
        reads = sdk.GroupBulkRead(line, PH)
        for each, (address, length) in blocks.items():
            reads.addParam(each, address, length)
        assert reads.fastBulkRead() == sdk.COMM_SUCCESS
        assert reads.getData(2, 12, 1) == 102
        assert reads.getData(4, 132, 4) == 2048
        return
    assert of_each(answers) == list(IDS)
    assert [answer.params for answer in answers] == wanted


def test_bulk_write_is_judged_one_by_one(line: SimLine) -> None:
    params = bytes((1, 65, 0, 1, 0, 1)) + bytes((2, 116, 0, 4, 0)) + (9_999).to_bytes(4, "little")
    params += bytes((3, 116, 0, 4, 0)) + (1_111).to_bytes(4, "little")
    params += bytes((4, 65, 0, 1, 0, 1))
    assert ask(line, ALL, Instruction.BULK_WRITE, params) == []
    assert line.shown("LED").tolist() == [1, 0, 0, 1]
    assert line.shown("Goal Position").tolist() == [2048, 2048, 1_111, 2048]


def test_a_sync_write_beyond_one_servos_limit_moves_the_others(line: SimLine) -> None:
    write(line, 3, 48, 2_100, 4)
    for servo in IDS:
        write(line, servo, 64, 1, 1)
    exchange(line, goals(dict.fromkeys(IDS, 2_300)))
    assert line.shown("Goal Position").tolist() == [2_300, 2_300, 2_048, 2_300]
    wait(line, 1.0)
    assert line.shown("Present Position")[[0, 1, 3]] == pytest.approx(2_300, abs=40)
    assert line.shown("Present Position")[2] == pytest.approx(2_048, abs=2)


@pytest.mark.fast_cases(16)
@pytest.mark.parametrize("code", [Instruction.SYNC_READ, Instruction.FAST_SYNC_READ])
@pytest.mark.parametrize("block", [(126, 10), (0, 147), (144, 3), (116, 4)])
def test_the_vectorised_way_says_what_the_general_one_says(
    servos: str, code: int, block: tuple[int, int]
) -> None:
    said = []
    for general in (False, True):
        line = make(servos)
        line.firmware.protection.detect(np.array([1]), 0x20)
        for servo in IDS:
            write(line, servo, 64, 1, 1)
        if general:
            line._group.execute = lambda *_, **__: None  # type: ignore[method-assign]
        exchange(line, goals({each: 2_000 + 50 * each for each in reversed(IDS)}))
        wait(line, 0.1)
        params = group_params(*block, IDS[::-1])
        said.append([(s.servo_id, s.error, s.params) for s in ask(line, ALL, code, params)])
    assert said[0] == said[1]
    assert len(said[0]) == (1 if code == Instruction.FAST_SYNC_READ else 4)


def test_a_register_that_some_lack_is_written_to_those_that_have_it(
    line: SimLine, servos: str
) -> None:
    """Goal Current(102), which XL430 and XC430 have not, by sync write and by bulk write."""
    has = [servo_model(model).measures_current for model in models(servos)]
    entry = (77).to_bytes(2, "little")
    together = b"".join(bytes((each,)) + entry for each in IDS)
    assert ask(line, ALL, Instruction.SYNC_WRITE, bytes((102, 0, 2, 0)) + together) == []
    for row, servo in enumerate(IDS):
        assert line.bank.table[row, 102:104].tobytes() == (entry if has[row] else b"\0\0")
        answer = write(line, servo, 102, 78, 2)
        assert answer == (ResultError.NONE if has[row] else ResultError.ACCESS)


def test_backup_outlives_a_factory_reset_and_a_power_cut(line: SimLine) -> None:
    for servo in IDS:
        write(line, servo, 31, 40 + servo, 1)
        write(line, servo, 84, 100 * servo, 2)
        write(line, servo, 60, 2, 1)
        assert ask(line, servo, 0x20, b"\x01CTRL")[0].error == 0
        ask(line, servo, Instruction.FACTORY_RESET, b"\x02")
    for row, servo in enumerate(IDS):
        assert read(line, servo, 147, 1) == 1
        assert ask(line, servo, 0x20, b"\x02CTRL")[0].error == 0
        assert line.shown("Temperature Limit")[row] == 40 + servo
    line.firmware.cut_power(np.array([3]))
    line.firmware.restore_power(np.array([3]))
    assert line.shown("Position P Gain").tolist() == [100, 200, 300, 400]
    write(line, 2, 64, 1, 1)
    assert ask(line, 2, 0x20, b"\x02CTRL")[0].result == ResultError.RESULT_FAIL


def test_indirect_addresses_read_and_write(line: SimLine, servos: str) -> None:
    """Both blocks; the 330 models have the first alone."""
    for servo, model in zip(IDS, models(servos), strict=True):
        small = len(servo_model(model).indirect) == 1
        for address, data in ((168, 224),) if small else ((168, 224), (578, 634)):
            for k in range(4):
                assert write(line, servo, address + 2 * k, 116 + k, 2) == 0
            assert write(line, servo, address + 8, 65, 2) == 0
            assert write(line, servo, data, 1_000 + servo, 4) == 0
            assert write(line, servo, data + 4, 1, 1) == 0
            assert read(line, servo, 116, 4) == read(line, servo, data, 4) == 1_000 + servo
            assert read(line, servo, 65, 1) == 1
            assert write(line, servo, data, 9_999, 4) == ResultError.DATA_LIMIT
    answers = ask(line, ALL, Instruction.SYNC_READ, group_params(224, 4, IDS))
    assert [int.from_bytes(a.params, "little") for a in answers] == [1_001, 1_002, 1_003, 1_004]


def test_watchdog_of_all_is_fed_by_any_packet_and_trips_all(line: SimLine) -> None:
    for servo in IDS:
        write(line, servo, 64, 1, 1)
        write(line, servo, 98, 5, 1)
    for _ in range(10):
        ask(line, 9, Instruction.PING)  # to nobody there; 20 ms each
        ask(line, 1, Instruction.READ, bytes((132, 0, 4, 0)))
        wait(line, 0.05)
    assert line.shown("Bus Watchdog").tolist() == [5] * 4
    wait(line, 0.2)
    assert line.shown("Bus Watchdog").tolist() == [255] * 4


# faults


def replying_ids(line: SimLine) -> list[int]:
    return of_each(ask(line, ALL, Instruction.SYNC_READ, group_params(132, 4, IDS)))


@pytest.mark.parametrize(
    ("kind", "keys", "wanted"),
    [
        ("drop", {}, [1, 2, 4]),
        ("corrupt", {}, [1, 2, 4]),
        ("truncate", {}, [1, 2, 4]),
        ("duplicate", {}, [1, 2, 3, 3, 4]),
        ("delay", {"by_s": 0.002}, [1, 2, 3, 4]),
        ("late", {}, [1, 2, 4]),
        ("mute", {}, [1, 2]),  # who stands behind waits for it
        ("brown_out", {}, [1, 2]),
    ],
)
def test_a_fault_of_the_third_servo(
    servos: str, kind: str, keys: dict[str, object], wanted: list[int]
) -> None:
    line = make(servos, fault(kind, ids=[3], at_s=0.2, for_s=0.2, **keys))
    assert replying_ids(line) == [1, 2, 3, 4]
    wait(line, 0.2)
    assert replying_ids(line) == wanted
    wait(line, 0.3)
    exchange(line, b"")  # what was late
    assert replying_ids(line) == [1, 2, 3, 4]


@pytest.mark.parametrize("code", [Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ])
@pytest.mark.parametrize("kind", ["drop", "corrupt", "truncate"])
def test_a_fast_answer_is_spoiled_if_one_that_writes_it_is_named(
    servos: str, kind: str, code: int
) -> None:
    line = make(servos, fault(kind, ids=[3]))

    def heard_of(*ids: int) -> int:
        bulk = b"".join(bytes((each, 132, 0, 4, 0)) for each in ids)
        params = bulk if code == Instruction.FAST_BULK_READ else group_params(132, 4, ids)
        return len(ask(line, ALL, code, params))

    assert heard_of(1, 2, 3, 4) == 0
    assert heard_of(1, 2, 4) == 1


@pytest.mark.parametrize("kind", ALARMS)
def test_an_error_is_seen_by_the_servo_named(servos: str, kind: str) -> None:
    if kind not in servo_model(models(servos)[2]).alarms:
        with pytest.raises(ConfigError, match=r"servo 3 detects overload, .* only"):
            make(servos, fault(kind, ids=[3]))
        return
    line = make(servos, fault(kind, ids=[3], at_s=0.5))
    for servo in IDS:
        write(line, servo, 64, 1, 1)
    wait(line, 0.5)
    masks = line.shown("Shutdown")
    assert line.shown("Hardware Error Status").tolist() == [0, 0, ALARMS[kind], 0]
    assert line.shown("Torque Enable").tolist() == [1, 1, int(not ALARMS[kind] & masks[2]), 1]
    assert [ask(line, each, Instruction.PING)[0].error for each in IDS] == [0, 0, ALERT, 0]


def test_reboot_heat_and_unplug(servos: str) -> None:
    script = fault("reboot", ids=[2], at_s=0.3) + fault("heat", ids=[3], celsius=99.0, at_s=0.3)
    line = make(servos, script + fault("unplug", behind=2, at_s=1.0, for_s=0.5))
    for servo in IDS:
        write(line, servo, 64, 1, 1)
    wait(line, 0.4)
    assert line.shown("Torque Enable").tolist() == [1, 0, 0, 1]
    assert line.shown("Hardware Error Status").tolist() == [0, 0, 4, 0]
    assert line.shown("Present Temperature")[2] == 99
    wait(line, 0.6)
    assert replying_ids(line) == [1, 2]
    assert line.firmware.powered.tolist() == [True, True, False, False]
    wait(line, 0.6)
    assert replying_ids(line) == [1, 2, 3, 4]
    assert line.shown("Torque Enable").tolist() == [1, 0, 0, 0]


def test_a_stuck_servo_trips_alone(servos: str) -> None:
    line = make(servos, fault("stuck", ids=[3], at_s=0.5))
    for servo in IDS:
        write(line, servo, 64, 1, 1)
    wait(line, 0.5)
    for _ in range(100):
        exchange(line, goals(dict.fromkeys(IDS, 3_500)))
    assert line.shown("Hardware Error Status").tolist() == [0, 0, 0x20, 0]
    at = line.shown("Present Position")
    assert at[[0, 1, 3]] == pytest.approx(3_500, abs=90)  # 330s have less gain
    assert at[2] == pytest.approx(2_048, abs=40)


def test_a_supply_reaches_the_servos_named_and_ends_at_their_own(servos: str) -> None:
    line = make(servos, fault("supply", volts=3.0, ids=[2, 3], at_s=0.2, for_s=0.3))
    wait(line, 0.1)
    usual = line.shown("Present Input Voltage").tolist()
    wait(line, 0.2)
    low = line.shown("Present Input Voltage").tolist()
    assert low == [usual[0], 30, 30, usual[3]]
    assert (line.shown("Hardware Error Status") != 0).tolist() == [False, True, True, False]
    wait(line, 0.4)
    assert line.shown("Present Input Voltage").tolist() == usual


def test_a_supply_without_names_reaches_all(servos: str) -> None:
    line = make(servos, fault("supply", volts=4.0, for_s=0.3))
    wait(line, 0.1)
    assert line.shown("Present Input Voltage").tolist() == [40] * 4
    wait(line, 0.4)
    nominal = [round(10 * MOTORS[model].nominal_v) for model in models(servos)]
    assert line.shown("Present Input Voltage") == pytest.approx(nominal, abs=1)


def test_one_id_on_two_servos(servos: str) -> None:
    line = make(servos, fault("clash", id=4, takes=1, at_s=0.1, for_s=0.5))
    line.bank["Moving Threshold"][3] = 99
    wait(line, 0.1)
    assert ask(line, 1, Instruction.READ, bytes((24, 0, 4, 0))) == []
    assert ask(line, 4, Instruction.PING) == []
    assert line._handler.collisions >= 1
    wait(line, 0.5)
    assert replying_ids(line) == [1, 2, 3, 4]


def test_the_same_file_gives_the_same_bytes(servos: str) -> None:
    script = "seed = 5\n" + fault("corrupt", chance=0.2) + fault("drop", chance=0.1)
    script += fault("brown_out", ids=[2], at_s=0.2, for_s=0.1)

    def run() -> list[tuple[float, bytes]]:
        line = make(servos, script)
        seen = []
        for k in range(30):
            raw = exchange(line, goals(dict.fromkeys(IDS, 2_048 + 10 * k)))
            raw += b"".join(s.params for s in ask(line, 1 + k % 4, Instruction.PING))
            seen.append((line.clock.now_s(), raw))
        return seen

    assert run() == run()
