"""A long run under faults: whether memory and lateness stay flat.

``python -m benchmarks.soak --simulated-h 24 --real-min 30`` runs in-process simulated servos in
simulated time, then servos that another process serves on a pseudo-terminal in real time. With
``--robot-min 20`` another process serves a robot of 16 joints on its ground instead. With
``--write`` it replaces the tables of ``docs/benchmarks/soak.md``. The parts are bounded by their
options; 0 leaves a part out.
"""

import argparse
import itertools
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.bus_faults import Bench
from benchmarks.command_facts import PROGRAM
from benchmarks.provenance import provenance, write_tables
from snakewalk.config.faults import FaultPlan
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import DriverError
from snakewalk.drivers.port.serial_port import SerialPort
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.faults.fault_player import FaultPlayer

PERIOD_S = 0.02
WINDOWS = 8
"""Rows of each table."""
JOINTS = 16
FAULT_EVERY_S = 20.0
"""Mean time between two faults of the simulated part."""
NOISE = 'seed = 1\n[[fault]]\nkind = "drop"\nchance = 0.0005\n'
"""Faults of the served part."""
SERVOS = ("--servos", f"1-{JOINTS}")
ROBOT = "yaw16"
"""Shipped robot of 16 joints."""


@dataclass(frozen=True)
class Window:
    """One part of a run."""

    end_s: float
    cycles: int
    trips: int
    memory_mb: float
    other_mb: float
    cpu_ms: float
    """Of a cycle."""
    late_ms: tuple[float, float, float]
    """Median, 99 % and most."""


def memory_mb(process: int | None = None) -> float:
    """Resident memory of a process, MB; the largest so far where the system does not tell."""
    try:
        text = Path(f"/proc/{process or os.getpid()}/statm").read_text(encoding="ascii")
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return int(text.split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def soak(
    link: SafeLink,
    clock: Clock,
    seconds: float,
    repair: Callable[[], None],
    other: int | None = None,
) -> list[Window]:
    """Swing the joints of a link for a time, and enable it again after each trip."""
    found = []
    start_s = clock.now_s()
    phase = np.arange(link.joint_count)
    number = itertools.count()
    for window in range(WINDOWS):
        end_s = start_s + seconds * (window + 1) / WINDOWS
        late_s: list[float] = []
        cycles = trips = 0
        cpu_s = time.process_time()
        next_s = clock.now_s()
        while next_s < end_s:
            clock.sleep_until_s(next_s)
            late_s.append(clock.now_s() - next_s)
            cycles += 1
            goal = 0.3 * (np.sin(2.5 * PERIOD_S * next(number) + phase) - np.sin(phase))
            try:
                link.read()
                link.write(JointCommand(clock.now_s(), goal))
            except DriverError:
                trips += 1
                number = itertools.count()
                repair()
                next_s = clock.now_s()
            next_s = max(next_s + PERIOD_S, clock.now_s() - PERIOD_S)
        late = 1e3 * np.array(late_s)
        found.append(
            Window(
                *(end_s - start_s, cycles, trips, memory_mb()),
                0.0 if other is None else memory_mb(other),
                1e3 * (time.process_time() - cpu_s) / max(cycles, 1),
                (float(np.median(late)), float(np.quantile(late, 0.99)), float(late.max())),
            )
        )
    return found


def simulated(hours: float, seed: int = 1) -> list[Window]:
    """Soak a simulated chain with a fault now and then."""
    bench = Bench(JOINTS)
    bench.start()
    bench.chain.on_event = lambda line: None  # a soak keeps no lines
    line, rng = bench.line, random.Random(seed)
    player = FaultPlayer(line, FaultPlan(seed=seed))

    def add(more_s: float) -> None:
        """Schedule the faults of the next time."""
        at_s, faults = 0.0, []
        while (at_s := at_s + rng.expovariate(1.0 / FAULT_EVERY_S)) < more_s:
            kind = rng.choice(
                ("mute", "reboot", "overload", "stuck", "brown_out", "port", "supply")
            )
            each: dict[str, object] = {"kind": kind, "at_s": at_s}
            if kind not in ("port", "supply"):
                each["ids"] = [rng.choice(bench.robot.servo_ids)]
            if kind not in ("reboot", "overload"):
                each["for_s"] = rng.choice((0.02, 0.2, 1.0))
            if kind == "supply":
                each["volts"] = rng.choice((9.7, 15.5))
            faults.append(each)
        player.add(FaultPlan.model_validate({"fault": faults}))

    def repair() -> None:
        """Let an operator reboot what has an alarm, and enable the chain again."""
        for _ in range(20):
            line.clock.advance(0.5)
            with suppress(DriverError):
                if not line.is_open:
                    bench.chain.reopen()
                bus = DynamixelBus(line)
                for servo_id in bench.robot.servo_ids:
                    if bus.read(servo_id, "Hardware Error Status"):
                        bus.reboot(servo_id)
                line.clock.advance(0.5)
                bench.link.reset("soak")
                bench.link.enable()
                return
        raise SystemExit("soak: the chain could not be enabled again in 20 tries")

    add(3600.0 * hours)
    try:
        return soak(bench.link, line.clock, 3600.0 * hours, repair)
    finally:
        with suppress(DriverError):
            bench.link.disable()


@contextmanager
def served(folder: Path, *what: str) -> Iterator[tuple[str, int]]:
    """Serve simulated servos by another process; its device and process ID."""
    (folder / "noise.toml").write_text(NOISE, encoding="utf-8")
    command = [
        *(sys.executable, "-u", "-c", PROGRAM),
        *("bus", "serve", *what, "--faults", str(folder / "noise.toml")),
    ]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as bus:
        assert bus.stdout is not None
        try:
            yield next(m[1] for x in bus.stdout if (m := re.match(r"port (\S+)", x))), bus.pid
        finally:
            bus.terminate()


def real(minutes: float, *what: str) -> list[Window]:
    """Soak a chain on a pseudo-terminal in real time; ``what`` are the options of the server."""
    robot = RobotConfig(name="soak", joint_axes="y" * JOINTS)
    safety = SafetyConfig(stale_limit_s=0.3, watchdog_s=0.5)
    with tempfile.TemporaryDirectory() as folder, served(Path(folder), *what) as (device, process):
        port = SerialPort(device, 1_000_000)
        bus = DynamixelBus(port, robot.models_by_id)
        chain = ServoChain(bus, robot, watchdog_s=safety.watchdog_s)
        link = SafeLink(chain, SafetyLimits.from_config(robot, safety), port.clock)

        def repair() -> None:
            for _ in range(20):
                with suppress(DriverError):
                    link.reset("soak")
                    link.enable()
                    return
                port.clock.sleep_until_s(port.clock.now_s() + 0.5)
            raise SystemExit("soak: the chain could not be enabled again in 20 tries")

        with link:
            repair()  # a busy machine may serve the first reads too late
            return soak(link, port.clock, 60.0 * minutes, repair, process)


def table(windows: list[Window], unit_s: float, unit: str, *, is_real: bool) -> str:
    """Markdown, and how much the memory has grown from the second window on."""
    server = " of the server, MB |" if is_real else ""
    lines = [
        f"| until, {unit} | cycles | trips | memory, MB |{server} CPU a cycle, ms "
        "| late, median, ms | late, 99 %, ms | late, most, ms |",
        "| ---: | ---: | ---: | ---: |" + (" ---: |" if is_real else "") + " ---: |" * 4,
    ]
    for each in windows:
        other = f" {each.other_mb:.1f} |" if is_real else ""
        late = " | ".join(f"{value:.2f}" for value in each.late_ms)
        lines.append(
            f"| {each.end_s / unit_s:.2f} | {each.cycles:,} | {each.trips} | {each.memory_mb:.1f} |"
            f"{other} {each.cpu_ms:.2f} | {late} |"
        )
    grown = windows[-1].memory_mb - windows[1].memory_mb
    cycles = sum(each.cycles for each in windows)
    trips = sum(each.trips for each in windows)
    lines += [
        "",
        f"{cycles:,} cycles, {trips} trips; memory {grown:+.1f} MB from the second row on.",
    ]
    return "\n".join(lines)


def main() -> None:
    """Run, show, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soak", description=__doc__)
    parser.add_argument("--simulated-h", type=float, default=24.0, help="simulated time, hours")
    parser.add_argument("--real-min", type=float, default=30.0, help="real time, minutes")
    parser.add_argument("--robot-min", type=float, default=20.0, help="of a robot, minutes")
    parser.add_argument("--write", action="store_true", help="replace the tables of the page")
    given = parser.parse_args()
    command = f"python -m benchmarks.soak {' '.join(sys.argv[1:])}"
    parts = (
        ("simulated", given.simulated_h, simulated, 3600.0, "h"),
        ("real time", given.real_min, lambda length: real(length, *SERVOS), 60.0, "min"),
        ("robot", given.robot_min, lambda length: real(length, "--robot", ROBOT), 60.0, "min"),
    )
    for name, length, run, unit_s, unit in parts:
        if length <= 0.0:
            continue
        text = table(run(length), unit_s, unit, is_real=name != "simulated")
        text = f"{provenance(command)}\n\n{text}"
        print(f"{name}\n{text}\n")
        if given.write:
            write_tables("soak", name, text)


if __name__ == "__main__":
    main()
