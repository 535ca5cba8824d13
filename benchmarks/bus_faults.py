"""What a run does under every kind of bus fault: the check that detects it, when, and the outcome.

``python -m benchmarks.bus_faults`` writes the tables of ``docs/benchmarks/bus-faults.md``. All
lines are simulated in this process, on a simulated clock: the result depends on the code alone.
"""

import math
import random
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.bus_fault_scenarios import AT_S, SCENARIOS, Scenario
from benchmarks.provenance import provenance, write_tables
from benchmarks.rows import Row
from snakewalk.config.faults import FaultPlan
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.fingerprint_file import FingerprintFile
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import DriverError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.recovery import Policy, Recovery
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

TITLE = "Bus faults: detected, silent, false alarms"
PAGE = "bus-faults"

WRONG_RAD = 0.1
"""A joint this much farther from its goal than before the fault is wrong (ours)."""
_DETECTORS = {
    "constantly, though": "motion sensors",
    "not continued": "recheck after the pause",
    "come and gone": "alert without an error",
    "not believed": "impossible motion",
    "no servo turns so fast": "impossible motion",
    "temperature and voltage not read": "age of the state",
    "Goal Position is": "goal read-back",
    "its zero has moved": "fingerprint",
    "other way round": "fingerprint",
    "Shutdown is": "fingerprint",
    "Limit is": "fingerprint",
    "Drive Mode is": "fingerprint",
    "another program write": "settings read-back",
    "changed its mode": "settings read-back",
    "Operating Mode is": "settings read-back",
    "exchanged": "identity read-back",
    "torque is off": "torque read-back",
    "it has rebooted": "settings read-back",
    "without a packet": "age of the state",
    "watchdog": "watchdog read-back",
    "does not push": "current at an error",
    "does not follow": "following error",
    "forced beyond": "joint limit",
    "carries an alert": "alert without an error",
    "alert bit": "alert without an error",
    "alarm": "hardware error",
    "too hot": "temperature limit",
    "temperature": "temperature sensor",
    "supply too": "supply voltage",
    "for too long": "current limit",
    "fast sync reads given up": "lost replies",
    "no servo was read": "lost replies",
    "after the time-out": "late replies",
    "not read for": "age of the state",
    "replies got lost": "lost replies",
    "port": "port",
    "same robot": "identity after a pause",
    "another robot": "identity after a pause",
    "elsewhere": "identity after a pause",
}
"""Check by the words of its message; the first match counts."""


@dataclass
class Result:
    """What happened."""

    detected_by: str = ""
    cycles: int | None = None
    outcome: str = ""
    silent: bool = False
    ended_by: str = ""
    ended_after: int | None = None
    reports: list[str] = field(default_factory=list)


class Bench:
    """A chain on a simulated line that swings at 50 Hz, with the safety of a run."""

    def __init__(
        self,
        joints: int = 6,
        *,
        baud: int = 1_000_000,
        period_s: float = 0.02,
        usb_latency_s: float = 1e-3,
        scenario: Scenario | None = None,
    ) -> None:
        self.robot = RobotConfig(name="bench", joint_axes="yp" * (joints // 2))
        self.plant = BenchPlant(joints)
        bank = ServoBank(self.robot.servo_ids, baud=baud)
        self.line = SimLine(bank, self.plant, usb_latency_s=usb_latency_s)
        self.period_s, self.reports = period_s, list[tuple[float, str]]()
        self.policy: Policy = scenario.policy if scenario else "stop"
        slow = max(1.0, period_s / 0.02)
        self.safety = SafetyConfig(
            stale_limit_s=0.1 * slow, slow_stale_limit_s=3.0 * slow, watchdog_s=min(0.2 * slow, 2.5)
        )

    def start(self, folder: Path | None = None) -> None:
        """Build chain and safety, and enable them."""
        file = None if folder is None else FingerprintFile(folder / "bench.toml")
        bus = DynamixelBus(self.line, latency_s=0.003)
        self.chain = ServoChain(
            bus, self.robot, watchdog_s=self.safety.watchdog_s, fingerprint_file=file
        )
        self.chain.on_event = self.report
        recovery = Recovery(self.chain, policy=self.policy, patience_s=2.0, on_event=self.report)
        limits = SafetyLimits.from_config(self.robot, self.safety)
        self.link = SafeLink(self.chain, limits, self.line.clock, recovery, on_event=self.report)
        self.link.enable()

    def report(self, line: str) -> None:
        """Keep a line with its time."""
        self.reports.append((self.line.clock.now_s(), line))

    def swing(
        self, cycles: int, amplitude_rad: float, each: Callable[[np.ndarray], None]
    ) -> str | None:
        """Swing; returns why it tripped, or None. ``each`` gets the true errors (J,)."""
        clock = self.line.clock
        start_s, phase = clock.now_s(), np.arange(self.robot.joint_count)
        for k in range(cycles):
            clock.sleep_until_s(start_s + k * self.period_s)
            time_s = k * self.period_s
            goal = amplitude_rad * (np.sin(2.5 * time_s + phase) - np.sin(phase))
            try:
                self.link.read()
                if self.link.tripped is not None:
                    return self.link.tripped
                self.link.write(JointCommand(clock.now_s(), goal))
            except DriverError as error:
                return str(error)
            each(np.abs(goal - self.line.firmware.plant.position_rad))
        return None


def try_scenario(scenario: Scenario, folder: Path) -> Result:
    """Run a scenario."""
    bench = Bench(scenario=scenario)
    if scenario.between_runs is not None:
        return _second_start(bench, scenario, folder)
    bench.start()
    bench.reports.clear()
    began_s = bench.line.clock.now_s() + AT_S
    plan = [{"at_s": 0.0, **each} for each in scenario.faults]
    for each in plan:
        each["at_s"] += AT_S
    FaultPlayer(bench.line, FaultPlan.model_validate({"seed": 1, "fault": plan}))
    if scenario.on_line is not None:
        begin = partial(scenario.on_line, bench.line)
        bench.line.firmware.events.schedule(began_s, begin)
    sound, after, irregular = [], [], []
    counted_before = list[int]()

    def note(error: np.ndarray) -> None:
        now_s, counters = bench.line.clock.now_s(), bench.chain.counters
        count = counters.timeouts + counters.unclean + counters.copies
        if now_s < began_s:
            share = min(1.0, 1.0 - (began_s - now_s - 0.1) / AT_S)  # it grows slowly
            yaw = range(0, len(error), 2)  # a pitch joint has not the current to carry it
            bench.plant.set_load(yaw, share * scenario.load_n_m)
            sound.append(float(error.max()))
            counted_before[:] = [count]
            return
        after.append(float(error.max()))
        if count > counted_before[0]:
            irregular.append(now_s)

    tripped = bench.swing(scenario.cycles, scenario.amplitude_rad, note)
    return _judge(bench, tripped, began_s, max(sound), after, irregular)


def _judge(
    bench: Bench,
    tripped: str | None,
    began_s: float,
    sound_rad: float,
    after_rad: list[float],
    irregular_s: list[float],
) -> Result:
    result = Result(reports=[line for _, line in bench.reports])
    times = list(bench.reports)
    if tripped is not None:
        times.append((bench.line.clock.now_s(), tripped))
    if times:
        first_s, line = times[0]
        if line.startswith("interrupted"):
            line = line.removeprefix("interrupted: ")
        result.detected_by = _detector(line)
    elif irregular_s:
        first_s, result.detected_by = irregular_s[0], "counted as irregular reads"
    else:
        first_s, result.detected_by = math.nan, "-"
    if math.isfinite(first_s):
        result.cycles = _cycles(first_s - began_s, bench)
    if tripped is not None:
        result.ended_by = _detector(tripped)
        result.ended_after = _cycles(bench.line.clock.now_s() - began_s, bench)
    settled = after_rad[len(after_rad) // 2 :]
    is_wrong = bool(settled) and float(np.median(settled)) > sound_rad + WRONG_RAD
    if tripped is not None:
        result.outcome = "off"
    elif bench.link.recoveries:
        result.outcome = "goes on after a check"
    elif bench.reports:
        result.outcome = "reported"
    else:
        result.outcome = "goes on"
    worst = max([0.0, *after_rad])
    is_wrong |= worst > 2.0 * WRONG_RAD + sound_rad
    result.silent = tripped is None and not bench.reports and is_wrong
    return result


def _second_start(bench: Bench, scenario: Scenario, folder: Path) -> Result:
    """Start, change the servos while the program is off, start again."""
    own = folder / scenario.name.replace(" ", "-")
    own.mkdir()
    bench.start(own)
    bench.link.disable()
    if scenario.between_runs is not None:
        scenario.between_runs(bench.line)
    bench.line.firmware.apply_registers()
    bench.reports.clear()
    try:
        bench.start(own)
    except DriverError as error:
        return Result("fingerprint file", 0, "does not start", reports=[str(error)])
    lines = [line for _, line in bench.reports]
    detected_by = "settings of the start" if lines else "-"
    return Result(detected_by, 0, "set again; starts", silent=not lines, reports=lines)


def _cycles(time_s: float, bench: Bench) -> int:
    return max(1, math.ceil(time_s / bench.period_s))


def _detector(line: str) -> str:
    return next((name for words, name in _DETECTORS.items() if words in line), line[:40])


def goal_reads() -> list[tuple[int, int, int]]:
    """Servos, baud, and cycles until a second master is named."""
    rows = []
    for joints, baud, period_s in (
        (16, 1_000_000, 0.02),
        (64, 4_000_000, 0.02),
        (16, 57_600, 0.2),
        (64, 57_600, 0.8),
    ):
        bench = Bench(joints, baud=baud, period_s=period_s)
        bench.start()
        cycles = [0]
        bench.swing(20, 0.1, lambda error: None)
        write = {"kind": "write", "ids": [joints], "register": "Goal Position", "value": 2300}
        fault = {**write, "at_s": 0.0, "every_s": period_s / 5}
        FaultPlayer(bench.line, FaultPlan.model_validate({"fault": [fault]}))

        def count(error: np.ndarray, cycles: list[int] = cycles) -> None:
            cycles[0] += 1

        tripped = bench.swing(200, 0.1, count)
        assert tripped is not None
        assert "second master" in tripped
        rows.append((joints, baud, cycles[0] + 1))
    return rows


@dataclass(frozen=True)
class Sound:
    """A bus without a fault."""

    joints: int
    baud: int
    period_s: float
    usb_latency_s: float
    amplitude_rad: float
    cycles: int
    alarms: Sequence[str]


def sound_buses(count: int = 20, cycles: int = 1000) -> list[Sound]:
    """Buses without a fault, of random size, rate and latency."""
    found = []
    for seed in range(count):
        rng = random.Random(seed)
        joints, baud, period_s = rng.choice(
            ((4, 57_600, 0.1), (6, 1_000_000, 0.02), (16, 1_000_000, 0.02), (64, 4_000_000, 0.02))
        )
        latency_s, amplitude_rad = rng.choice((0.0, 1e-3, 2e-3)), rng.uniform(0.02, 0.5)
        bench = Bench(joints, baud=baud, period_s=period_s, usb_latency_s=latency_s)
        bench.start()
        tripped = bench.swing(cycles, amplitude_rad, lambda error: None)
        alarms = [line for _, line in bench.reports] + ([tripped] if tripped else [])
        found.append(Sound(joints, baud, period_s, latency_s, amplitude_rad, cycles, alarms))
    return found


def run() -> list[Row]:
    """Measure."""
    results, buses = try_all(), sound_buses()
    harmful = [each for each in results if not each[0].is_harmless]
    detected = sum(each.detected_by != "-" for _, each in harmful)
    silent = sum(each.silent for _, each in results)
    alarms = sum(len(each.alarms) for each in buses)
    alarms += sum(scenario.is_harmless and bool(each.reports) for scenario, each in results)
    return [
        Row("scenarios", len(results), ""),
        Row("detected", detected, "", "harmful", detected / len(harmful)),
        Row("silent", silent, "", "none", silent, 0.0),
        Row("false alarms on sound buses", alarms, "", "none", alarms, 0.0),
    ]


def try_all() -> list[tuple[Scenario, Result]]:
    """Run all scenarios."""
    with tempfile.TemporaryDirectory() as folder:
        return [(each, try_scenario(each, Path(folder))) for each in SCENARIOS]


def main() -> None:
    """Write the page."""
    results, buses = try_all(), sound_buses()
    lines = [
        *(provenance("python -m benchmarks.bus_faults"), ""),
        f"{len(results)} scenarios, {sum(each.silent for _, each in results)} silent.",
        "",
        "| fault | first report | cycles | outcome | ended by | cycles |",
        "| --- | --- | ---: | --- | --- | ---: |",
    ]
    for scenario, result in results:
        cycles = "" if result.cycles is None else str(result.cycles)
        ended = "" if result.ended_after is None else str(result.ended_after)
        ended_by = result.ended_by
        if ended and (ended_by, ended) == (result.detected_by, cycles):
            ended_by, ended = "=", ""
        outcome = result.outcome + ", **silent**" * result.silent
        lines.append(
            f"| {scenario.name} | {result.detected_by} | {cycles} | {outcome} "
            f"| {ended_by} | {ended} |"
        )
    write_tables(PAGE, "faults", "\n".join(lines))
    lines = ["| servos | baud | cycles until a second master is named |", "| ---: | ---: | ---: |"]
    lines += [f"| {joints} | {baud:,} | {cycles} |" for joints, baud, cycles in goal_reads()]
    write_tables(PAGE, "goal reads", "\n".join(lines))
    alarms = [line for each in buses for line in each.alarms]
    total = f"{len(buses)} buses, {sum(each.cycles for each in buses):,} cycles"
    write_tables(PAGE, "sound buses", f"{total}, {len(alarms)} false alarms.")
    for _, result in results:
        print(result.detected_by, "|", *result.reports[:1])


if __name__ == "__main__":
    main()
