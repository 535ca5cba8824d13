"""The control cycle of 16 servos: goals out, current, velocity and position back.

Ours is ``drivers.bus.control_cycle`` on ``drivers.port.serial_port``. Beside it the group calls of
``dynamixel-sdk`` on its own port handler, with the values taken out as a user must, and
``rustypot`` where it is installed (its call takes and gives lists of bytes per servo). All talk to
the same servos on a paced pseudo-terminal in another process, on another core, and CPU time is that
of the process with the program: while bytes are on the wire it waits or spins, as each of them does
on metal. They take turns, a short window each, so that whatever else the machine does meets all of
them alike.

The wire begins when ``write`` has returned (``benchmarks.wire_times``), and the last byte of an
answer is handed to the kernel when it is due. So what a cycle takes beyond the wire time is: from
its begin to the return of the (first) ``write``, then, from the last byte's time to the value in
the program's hands (the kernel passing it on, waking up, parsing). Both are shown, and how late the
pseudo-terminal itself was. It does not model what an adapter adds.

Ours is measured as a chain uses it (goals written when they are known, the state read in the next
cycle: two writes), and as one call, ``ControlCycle.read`` (both packets in one write). The
rivals have no such call.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import dynamixel_sdk as sdk
import numpy as np
from numpy.typing import NDArray

from benchmarks.rows import Row
from benchmarks.wire_times import Answer, WireTimes, build_library
from snakewalk.drivers.bus.budget import wire_budget
from snakewalk.drivers.bus.control_cycle import SPIN_FROM_BAUD, SPIN_S, ControlCycle
from snakewalk.drivers.port.serial_port import SerialPort

TITLE = "Control cycle of 16 servos on a paced pseudo-terminal"

IDS = tuple(range(1, 17))
CYCLES = 40
"""In a window, of one way."""
WARM = 20
"""Before them: what is learnt about the line is learnt in these."""
WINDOWS = 16
BAUDS = (1_000_000, 3_000_000, 4_000_000)
FIFTH = 0.2
OF_RUSTYPOT = {False: 1.0, True: 1.1}
"""Largest share of rustypot's CPU time, plain and fast."""
OVER_WIRE = 1.06
"""Largest cycle over wire time."""
POLLING = "cycle that polls"
"""Below 3 Mbaud: as the driver was before it slept until the bytes arrive."""

LEAST = 0.5
"""Share of cycles that must go well; others suffer when a program takes the servos' core away."""

Cycle = Callable[[int], bool]
"""One cycle; whether all servos answered."""
Way = Callable[[], tuple[Cycle, Callable[[], None]]]
"""Opens the port; a cycle, and how to close it."""


@dataclass(frozen=True, slots=True)
class Cost:
    """Of one cycle, s."""

    cpu_s: float
    wall_s: float
    before_s: float
    """Until its first ``write`` has returned."""
    after_s: float
    """From the time at which the last byte was due."""
    late_s: float
    """How much later than that it was given to the kernel; within ``after_s``."""
    heard_s: float
    """How much later than written the servos' end heard of the question; in none of them."""


@contextmanager
def paced_servos(baud: int, times: Path, *, stamped: bool) -> Iterator[str]:
    """Servos in a process of their own; yields the device."""
    command = [sys.executable, "-m", "benchmarks.paced_pty", str(baud), str(times)]
    command += [] if stamped else ["--as-heard"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as servos:
        if servos.stdout is None or servos.stdin is None:
            raise RuntimeError("no pipes")
        yield servos.stdout.readline().strip()
        servos.stdin.close()
        servos.wait()


def ours(
    device: str, baud: int, *, fast: bool, at_once: bool = False, spin_s: float | None = None
) -> tuple[Cycle, Callable[[], None]]:
    """Our codec on our port, and how to close it."""
    port = SerialPort(device, baud)
    cycle = ControlCycle(port, IDS, fast=fast, latency_s=0.05, spin_s=spin_s)
    goals = np.full(len(IDS), 2048, np.int32)

    def turn(k: int) -> bool:
        if at_once:
            return bool(cycle.read(goals + k).valid.all())
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
        try:
            if read() != sdk.COMM_SUCCESS:
                return False
        except IndexError:
            return False  # what it makes of a fast answer that is cut short
        for servo in IDS:
            for address, size in ((126, 2), (128, 4), (132, 4)):
                reads.getData(servo, address, size)
        return True

    return turn, port.closePort


def of_rustypot(device: str, baud: int, *, fast: bool) -> tuple[Cycle, Callable[[], None]]:
    """Sync write and (fast) sync read of raw bytes; their conversion, as ours, by numpy."""
    import rustypot  # noqa: PLC0415  not a dependency

    bus = rustypot.Xl330PyController(device, baud, 0.05)
    bus.set_fast_sync_read(fast)
    ids = list(IDS)

    def turn(k: int) -> bool:
        try:
            bus.sync_write_raw_goal_position(ids, [2048 + k] * len(ids))
            blocks = bus.sync_read_raw_data(ids, 126, 10)
        except RuntimeError:
            return False  # it was not answered, or sent, in time
        raw = np.frombuffer(b"".join(blocks), np.uint8)
        raw.reshape(-1, 10)[:, :2].copy().view("<i2")
        return True

    return turn, lambda: None


def measure(ways: dict[str, Way], times: WireTimes, *, stamped: bool) -> dict[str, Cost]:
    """Cost of a cycle of each way: medians of a window, those of the window with the least.

    CPU time and wall time are each the least of all windows; what the latter consists of is that of
    the same window. The port is opened again in each window, since only one program may hold it;
    some cycles first, and those that fail, do not count.
    """
    found: dict[str, list[NDArray[np.float64]]] = {name: [] for name in ways}
    for _ in range(WINDOWS):
        for name, open_way in ways.items():
            turn, close = open_way()
            for k in range(WARM):
                turn(k)
            costs = []
            for k in range(CYCLES):
                first, answers = times.write_count, times.answer_count
                cpu, begun_ns = time.process_time(), time.monotonic_ns()
                good = turn(k)
                done_ns, cpu = time.monotonic_ns(), time.process_time() - cpu
                if good:
                    written_ns = times.write(first)[1] if stamped else begun_ns
                    while times.answer_count == answers:
                        continue  # the servos have given it, and are about to say when
                    answer = times.answer(answers)
                    costs.append((cpu, *_split(begun_ns, written_ns, done_ns, answer)))
            close()
            del turn, close
            if len(costs) >= LEAST * CYCLES:
                found[name].append(np.median(costs, axis=0))
    for name, windows in found.items():
        if not windows:
            raise RuntimeError(f"{name}: too many cycles fail: the servos need a core of their own")
    quickest = {name: min(windows, key=lambda window: window[1]) for name, windows in found.items()}
    cpu_s = {name: min(float(window[0]) for window in windows) for name, windows in found.items()}
    return {name: Cost(cpu_s[name], *row[1:].tolist()) for name, row in quickest.items()}


def _split(
    begun_ns: int, written_ns: int, done_ns: int, answer: Answer
) -> tuple[float, float, float, float, float]:
    return (
        (done_ns - begun_ns) * 1e-9,
        (written_ns - begun_ns) * 1e-9,
        (done_ns - answer.due_ns) * 1e-9,
        (answer.given_ns - answer.due_ns) * 1e-9,
        (answer.heard_ns - answer.asked_ns) * 1e-9,
    )


def run() -> list[Row]:
    """Measure, in a process with the library preloaded."""
    rows = []
    with TemporaryDirectory() as folder:
        library, file = build_library(Path(folder)), Path(folder) / "times"
        for baud in BAUDS:
            WireTimes.create(file)
            with paced_servos(baud, file, stamped=library is not None) as device:
                stamps = {
                    "LD_PRELOAD": str(library or ""),
                    "WIRE_TIMES_DEVICE": device,
                    "WIRE_TIMES_FILE": str(file),
                }
                measured = subprocess.run(
                    [sys.executable, "-m", "benchmarks.cycle_codec", device, str(baud), str(file)],
                    env=os.environ | stamps,
                    stdout=subprocess.PIPE,
                    check=True,
                )
            rows += [Row(**row) for row in json.loads(measured.stdout)]
    if library is None:
        rows.append(Row("no C compiler: the wire begins when the question is heard", 0.0, ""))
    return rows


def main() -> None:
    """Measure at one baud rate, on all cores but the servos'; rows as JSON."""
    device, baud, times = sys.argv[1], int(sys.argv[2]), WireTimes(Path(sys.argv[3]))
    cores = os.sched_getaffinity(0)
    if len(cores) > 1:
        os.sched_setaffinity(0, cores - {max(cores)})
    stamped = bool(os.environ["LD_PRELOAD"])
    rows = []
    for fast in (False, True):
        rows += _compare(device, baud, times, fast=fast, stamped=stamped)
    json.dump([asdict(row) for row in rows], sys.stdout)


def _compare(device: str, baud: int, times: WireTimes, *, fast: bool, stamped: bool) -> list[Row]:
    title = f"{baud / 1e6:g} Mbaud{', fast' if fast else ''}"
    wire_s = wire_budget(len(IDS), baud, fast=fast).cycle_s
    ways: dict[str, Way] = {
        "cycle": lambda: ours(device, baud, fast=fast),
        "cycle in one call": lambda: ours(device, baud, fast=fast, at_once=True),
        "dynamixel-sdk": lambda: of_sdk(device, baud, fast=fast),
    }
    if baud < SPIN_FROM_BAUD:
        ways[POLLING] = lambda: ours(device, baud, fast=fast, spin_s=SPIN_S)
    rusty = find_spec("rustypot") is not None
    if rusty:
        ways["rustypot"] = lambda: of_rustypot(device, baud, fast=fast)
    lost = times.lost
    found = measure(ways, times, stamped=stamped)
    rows = []
    for name, cost in found.items():
        own = name.startswith("cycle") and name != POLLING
        rows.append(_cpu_row(f"{title}: {name}", cost, found["dynamixel-sdk"], own=own))
        if name.startswith("cycle") and rusty:
            ratio = cost.cpu_s / found["rustypot"].cpu_s
            most = OF_RUSTYPOT[fast] if own else None
            rows.append(Row("  the same", cost.cpu_s * 1e6, "us", "rustypot", ratio, most))
        ratio = cost.wall_s / wire_s
        target = OVER_WIRE if own else None
        rows.append(Row("  its time", cost.wall_s * 1e3, "ms", "wire time", ratio, target))
        if stamped:
            rows.append(Row("    until it is written", cost.before_s * 1e6, "us"))
        rows.append(Row("    after the last byte's time", cost.after_s * 1e6, "us"))
        rows.append(Row("      of it the pacing, late", cost.late_s * 1e6, "us"))
        rows.append(Row("    not counted: heard so late", cost.heard_s * 1e6, "us"))
    if times.lost > lost:
        rows.append(Row("writes that the servos' end has not heard", times.lost - lost, ""))
    if not fast and not rusty:
        rows.append(Row("rustypot is not installed: pip install rustypot", 0.0, ""))
    return rows


def _cpu_row(what: str, cost: Cost, sdk_cost: Cost, *, own: bool) -> Row:
    if not own:
        return Row(what, cost.cpu_s * 1e6, "us")
    return Row(what, cost.cpu_s * 1e6, "us", "dynamixel-sdk", cost.cpu_s / sdk_cost.cpu_s, FIFTH)


if __name__ == "__main__":
    main()
