"""Every call of ``ftservo-python-sdk`` on a device; prints the results as JSON."""

import json
import sys
import time

import scservo_sdk as scs

TRIES = 10
PATIENCE = 500.0
"""The SDK waits for some milliseconds of real time; a busy machine may need more."""
real_ms = scs.PortHandler.getCurrentTime
scs.PortHandler.getCurrentTime = lambda port: real_ms(port) / PATIENCE
port = scs.PortHandler(sys.argv[1])
assert port.openPort()
assert port.setBaudRate(1_000_000)
handler = scs.sms_sts(port)


def call(name, *args):
    """Repeat a call that ran into its time-out: the machine may be busy."""
    for _ in range(TRIES):
        *values, result, error = getattr(handler, name)(*args)
        if result == scs.COMM_SUCCESS:
            assert error == 0, (name, error)
            return values
    raise AssertionError((name, args, result))


def settled(servo_id):
    end_s = time.monotonic() + 100.0
    while time.monotonic() < end_s:
        if call("ReadMoving", servo_id) == [0]:
            return
    raise AssertionError("it never stops")


found = {"model": call("ping", 1)}
call("WritePosEx", 1, 2500, 3000, 50)
call("write1ByteTxRx", 1, scs.SMS_STS_TORQUE_ENABLE, 1)
settled(1)
found["position"], found["speed"] = call("ReadPosSpeed", 1)
found["same"] = [*call("ReadPos", 1), *call("ReadSpeed", 1)]
call("RegWritePosEx", 2, 1700, 3000, 50)
call("write1ByteTxRx", 2, scs.SMS_STS_TORQUE_ENABLE, 1)
assert handler.RegAction() == scs.COMM_SUCCESS
for servo_id in (1, 3):
    assert handler.SyncWritePosEx(servo_id, 2222, 3000, 50)
assert handler.groupSyncWrite.txPacket() == scs.COMM_SUCCESS
handler.groupSyncWrite.clearParam()
for servo_id in (1, 2):
    settled(servo_id)
reader = scs.GroupSyncRead(handler, scs.SMS_STS_PRESENT_POSITION_L, 4)
for servo_id in (1, 2, 3):
    assert reader.addParam(servo_id)
for _ in range(TRIES):
    if reader.txRxPacket() == scs.COMM_SUCCESS:
        break
found["together"] = [
    reader.getData(servo_id, scs.SMS_STS_PRESENT_POSITION_L, 2) for servo_id in (1, 2, 3)
]
call("unLockEprom", 3)
call("WheelMode", 3)
call("LockEprom", 3)
call("WriteSpec", 3, -800, 0)
call("write1ByteTxRx", 3, scs.SMS_STS_TORQUE_ENABLE, 1)
end_s, near = time.monotonic() + 100.0, 0
while near < 5 and time.monotonic() < end_s:  # it overshoots
    found["wheel"] = call("ReadSpeed", 3)
    near = near + 1 if abs(found["wheel"][0] + 800) < 80 else 0
found["mode"] = call("read1ByteTxRx", 3, scs.SMS_STS_MODE)
port.closePort()
print(json.dumps(found))
