"""The control cycle of 16 servos: goals out, current, velocity and position back.

Ours is ``drivers.cycle`` on ``drivers.serial_port``. Beside it the group calls of ``dynamixel-sdk``
on its own port handler, with the values taken out as a user must, and ``rustypot`` where it is
installed (its call takes and gives lists of bytes per servo). All talk to the same servos on a
paced pseudo-terminal in another process, and CPU time is that of this process: while bytes are on
the wire it waits or spins, as each of them does on metal. They take turns, a short window each, so
that whatever else the machine does meets all of them alike.

Ours is measured as a chain uses it (goals written when they are known, the state read in the next
cycle: two writes), and as one call, ``GroupCycle.turn`` (both packets in one write). The rivals
have no such call. How far ``rustypot``, compiled as a whole, lies above the wire time says what the
pseudo-terminal and two processes that wake each other cost here.
"""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec

import dynamixel_sdk as sdk
import numpy as np
from numpy.typing import NDArray

from benchmarks.rows import Row
from drivers.budget import wire_budget
from drivers.cycle import GroupCycle
from drivers.serial_port import SerialPort

TITLE = "Control cycle of 16 servos on a paced pseudo-terminal"

IDS = tuple(range(1, 17))
CYCLES = 50
"""In a window, of one way."""
WINDOWS = 8
BAUDS = (1_000_000, 3_000_000, 4_000_000)
FIFTH = 0.2
OVER_WIRE = {False: 1.08, True: 1.13}
"""Largest cycle over wire time, plain and fast."""

LEAST = 0.5
"""Share of cycles that must go well; others suffer when a program takes the servos' core away."""

Cycle = Callable[[int], bool]
"""One cycle; whether all servos answered."""
Way = Callable[[], tuple[Cycle, Callable[[], None]]]
"""Opens the port; a cycle, and how to close it."""


@contextmanager
def paced_servos(baud: int) -> Iterator[str]:
    """Servos in a process of their own; yields the device."""
    command = [sys.executable, "-m", "benchmarks.paced_pty", str(baud)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as servos:
        if servos.stdout is None or servos.stdin is None:
            raise RuntimeError("no pipes")
        yield servos.stdout.readline().strip()
        servos.stdin.close()
        servos.wait()


def ours(
    device: str, baud: int, *, fast: bool, at_once: bool = False
) -> tuple[Cycle, Callable[[], None]]:
    """Our codec on our port, and how to close it."""
    port = SerialPort(device, baud)
    cycle = GroupCycle(port, IDS, fast=fast, latency_s=0.05)
    goals = np.full(len(IDS), 2048, np.int32)

    def turn(k: int) -> bool:
        if at_once:
            return bool(cycle.turn(goals + k).valid.all())
        cycle.write_goals(goals + k)
        return bool(cycle.read().valid.all())

    return turn, port.closePort


def of_sdk(device: str, baud: int, *, fast: bool) -> tuple[Cycle, Callable[[], None]]:
    """GroupSyncWrite and GroupSyncRead, values taken out one by one."""
    port, packets = sdk.PortHandler(device), sdk.PacketHandler(2.0)
    port.openPort()
    port.setBaudRate(baud)
    writes = sdk.GroupSyncWrite(port, packets, 116, 4)
    reads = sdk.GroupSyncRead(port, packets, 126, 10)
    for servo in IDS:
        reads.addParam(servo)
        writes.addParam(servo, [0, 8, 0, 0])
    read = reads.fastSyncRead if fast else reads.txRxPacket

    def turn(k: int) -> bool:
        goal = list((2048 + k).to_bytes(4, "little"))
        for servo in IDS:
            writes.changeParam(servo, goal)
        writes.txPacket()
        if read() != sdk.COMM_SUCCESS:
            return False
        for servo in IDS:
            for address, size in ((126, 2), (128, 4), (132, 4)):
                reads.getData(servo, address, size)
        return True

    return turn, port.closePort


def of_rustypot(device: str, baud: int) -> tuple[Cycle, Callable[[], None]]:
    """Sync write and sync read of raw bytes; their conversion, as ours, by numpy."""
    import rustypot  # noqa: PLC0415  not a dependency

    bus = rustypot.Xl330PyController(device, baud, 0.05)
    ids = list(IDS)

    def turn(k: int) -> bool:
        bus.sync_write_raw_goal_position(ids, [2048 + k] * len(ids))
        raw = np.frombuffer(b"".join(bus.sync_read_raw_data(ids, 126, 10)), np.uint8)
        raw.reshape(-1, 10)[:, :2].copy().view("<i2")
        return True

    return turn, lambda: None


def measure(ways: dict[str, Way]) -> dict[str, tuple[float, float]]:
    """CPU and wall time of a cycle of each way, s: medians of a window, least of all windows.

    The port is opened anew in each window, since only one program may hold it; some cycles first,
    and those that fail, do not count.
    """
    found: dict[str, list[NDArray[np.float64]]] = {name: [] for name in ways}
    for _ in range(WINDOWS):
        for name, open_way in ways.items():
            turn, close = open_way()
            for k in range(5):
                turn(k)
            lasts = []
            for k in range(CYCLES):
                cpu, wall = time.process_time(), time.perf_counter()
                if turn(k):
                    lasts.append((time.process_time() - cpu, time.perf_counter() - wall))
            close()
            del turn, close
            if len(lasts) >= LEAST * CYCLES:
                found[name].append(np.median(lasts, axis=0))
    for name, windows in found.items():
        if not windows:
            raise RuntimeError(f"{name}: too many cycles fail: the servos need a core of their own")
    least = {name: np.min(windows, axis=0) for name, windows in found.items()}
    return {name: (float(cpu_s), float(wall_s)) for name, (cpu_s, wall_s) in least.items()}


def run() -> list[Row]:
    """Measure."""
    rows = []
    for baud in BAUDS:
        with paced_servos(baud) as device:
            for fast in (False, True):
                rows += _compare(device, baud, fast=fast)
    return rows


def _compare(device: str, baud: int, *, fast: bool) -> list[Row]:
    title = f"{baud / 1e6:g} Mbaud, {'fast' if fast else 'plain'}"
    wire_s = wire_budget(len(IDS), baud, fast=fast).cycle_s
    ways: dict[str, Way] = {
        "cycle": lambda: ours(device, baud, fast=fast),
        "cycle in one call": lambda: ours(device, baud, fast=fast, at_once=True),
        "dynamixel-sdk": lambda: of_sdk(device, baud, fast=fast),
    }
    rusty = not fast and find_spec("rustypot") is not None
    if rusty:
        ways["rustypot"] = lambda: of_rustypot(device, baud)
    found = measure(ways)
    limit = OVER_WIRE[fast] if baud > 1_000_000 else None
    rows = []
    for name in ("cycle", "cycle in one call"):
        cpu_s, wall_s = found[name]
        ratio = cpu_s / found["dynamixel-sdk"][0]
        rows.append(Row(f"{title}, {name}: CPU", cpu_s * 1e6, "us", "dynamixel-sdk", ratio, FIFTH))
        if rusty:
            ratio = cpu_s / found["rustypot"][0]
            rows.append(Row("  the same", cpu_s * 1e6, "us", "rustypot", ratio, 1.0))
        rows.append(Row("  its time", wall_s * 1e3, "ms", "wire time", wall_s / wire_s, limit))
    for name in ("dynamixel-sdk", "rustypot") if rusty else ("dynamixel-sdk",):
        wall_s = found[name][1]
        rows.append(Row(f"  that of {name}", wall_s * 1e3, "ms", "wire time", wall_s / wire_s))
    if not fast and not rusty:
        rows.append(Row("rustypot is not installed: pip install rustypot", 0.0, ""))
    return rows
