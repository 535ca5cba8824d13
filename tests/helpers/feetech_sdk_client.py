"""Calls of ``feetech-servo-sdk`` on a device, in either byte order; prints the results as JSON."""

import json
import sys

import scservo_sdk as scs

TRIES = 10
PATIENCE = 500.0
"""The SDK waits for some milliseconds of real time; a busy machine may need more."""
real_ms = scs.PortHandler.getCurrentTime
scs.PortHandler.getCurrentTime = lambda port: real_ms(port) / PATIENCE
port = scs.PortHandler(sys.argv[1])
assert port.openPort()
assert port.setBaudRate(1_000_000)
big_endian = int(sys.argv[2])
handler = scs.PacketHandler(big_endian)


def call(name, *args):
    """Repeat a call that ran into its time-out: the machine may be busy."""
    for _ in range(TRIES):
        *values, result, error = getattr(handler, name)(port, *args)
        if result == scs.COMM_SUCCESS:
            assert error == 0, (name, error)
            return values
    raise AssertionError((name, args, result))


found = {"model": call("ping", 1)}
lock = 48 if big_endian else 55
call("write1ByteTxRx", 1, lock, 0)
call("write2ByteTxRx", 1, 11, 900)
call("write1ByteTxRx", 1, lock, 1)
found["limit"] = call("read2ByteTxRx", 1, 11)
found["limit bytes"] = call("readTxRx", 1, 9, 4)[0]
writer = scs.GroupSyncWrite(port, handler, 42, 2)
for servo_id, goal in ((1, 610), (2, 420)):
    low, high = scs.SCS_LOBYTE(goal), scs.SCS_HIBYTE(goal)
    assert writer.addParam(servo_id, [low, high])
assert writer.txPacket() == scs.COMM_SUCCESS
found["goals"] = [call("read2ByteTxRx", servo_id, 42)[0] for servo_id in (1, 2)]
if not big_endian:
    call("write1ByteTxRx", 2, 40, 128)  # the present position becomes the middle
    found["middle"] = call("read2ByteTxRx", 2, 56)
    reader = scs.GroupSyncRead(port, handler, 56, 2)
    for servo_id in (1, 2):
        assert reader.addParam(servo_id)
    for _ in range(TRIES):
        if reader.txRxPacket() == scs.COMM_SUCCESS:
            break
    found["together"] = [reader.getData(servo_id, 56, 2) for servo_id in (1, 2)]
call("regWriteTxRx", 1, 40, 1, [1])
assert handler.action(port, scs.BROADCAST_ID) == scs.COMM_SUCCESS
found["torque"] = call("read1ByteTxRx", 1, 40)
port.closePort()
print(json.dumps(found))
