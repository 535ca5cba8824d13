"""The DYNAMIXEL SDK, unmodified, on the simulated line."""

import dynamixel_sdk as sdk
import pytest

from tests.helpers.bus import a_line

OK = (sdk.COMM_SUCCESS, 0)
IDS = range(1, 5)


@pytest.fixture
def ph() -> sdk.Protocol2PacketHandler:
    return sdk.PacketHandler(2.0)


def test_service_work(ph: sdk.Protocol2PacketHandler) -> None:
    line = a_line(4, delay=250)
    assert ph.ping(line, 3) == (1020, *OK)
    found, result = ph.broadcastPing(line)
    assert result == sdk.COMM_SUCCESS
    assert found == {servo: [1020, 48] for servo in IDS}
    assert ph.write1ByteTxRx(line, 2, 9, 0) == OK
    assert ph.read1ByteTxRx(line, 2, 9) == (0, *OK)
    assert ph.read4ByteTxRx(line, 2, 132) == (2048, *OK)
    assert ph.regWriteTxRx(line, 2, 116, 4, [0, 4, 0, 0]) == OK
    assert ph.action(line, 2) == sdk.COMM_SUCCESS
    line.drain_until_quiet(1e-3)  # the SDK does not wait for the answer to Action
    assert ph.read4ByteTxRx(line, 2, 116) == (1024, *OK)
    assert ph.reboot(line, 2) == OK
    assert ph.read4ByteTxRx(line, 2, 116) == (2048, *OK)
    assert ph.clearMultiTurn(line, 2) == OK


def test_a_missing_servo_times_out_in_simulated_time(ph: sdk.Protocol2PacketHandler) -> None:
    line = a_line(1)
    start_s = line.clock.now_s()
    assert ph.ping(line, 9) == (0, sdk.COMM_RX_TIMEOUT, 0)
    assert 0.034 <= line.clock.now_s() - start_s < 0.036  # two latency timers and 2 ms
    assert ph.ping(line, 1) == (1020, *OK)


def test_errors_come_through(ph: sdk.Protocol2PacketHandler) -> None:
    line = a_line(1)
    assert ph.write4ByteTxRx(line, 1, 116, 5000) == (0, sdk.ERRNUM_DATA_LIMIT)
    line.bank["Hardware Error Status"][:] = 0x20
    assert ph.read1ByteTxRx(line, 1, 70) == (0x20, 0, sdk.ERRBIT_ALERT)


def test_groups_move_the_shafts(ph: sdk.Protocol2PacketHandler) -> None:
    line = a_line(4)
    writes = sdk.GroupSyncWrite(line, ph, 116, 4)
    reads = sdk.GroupSyncRead(line, ph, 126, 10)
    for servo in IDS:
        assert ph.write1ByteTxRx(line, servo, 64, 1) == OK
        writes.addParam(servo, list((2048 + 100 * servo).to_bytes(4, "little")))
        reads.addParam(servo)
    for k in range(100):
        assert writes.txPacket() == sdk.COMM_SUCCESS
        how = reads.txRxPacket if k % 2 else reads.fastSyncRead
        assert how() == sdk.COMM_SUCCESS
        line.clock.advance(0.02)
    for servo in IDS:
        assert abs(reads.getData(servo, 132, 4) - (2048 + 100 * servo)) <= 20
    assert line.collisions == 0


def test_bulk_read_and_write(ph: sdk.Protocol2PacketHandler) -> None:
    line = a_line(2)
    writes, reads = sdk.GroupBulkWrite(line, ph), sdk.GroupBulkRead(line, ph)
    writes.addParam(1, 116, 4, [0, 4, 0, 0])
    writes.addParam(2, 65, 1, [1])
    assert writes.txPacket() == sdk.COMM_SUCCESS
    reads.addParam(1, 116, 4)
    reads.addParam(2, 65, 1)
    assert reads.txRxPacket() == sdk.COMM_SUCCESS
    assert (reads.getData(1, 116, 4), reads.getData(2, 65, 1)) == (1024, 1)
    assert reads.fastBulkRead() == sdk.COMM_SUCCESS
    assert (reads.getData(1, 116, 4), reads.getData(2, 65, 1)) == (1024, 1)
