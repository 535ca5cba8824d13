"""Runs a chain through scenarios of faults and counts what happened."""

import random
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field, fields

import numpy as np

from snakewalk.drivers.errors import DriverError, PortError, SafetyTrippedError
from snakewalk.drivers.port.byte_port import reopen
from snakewalk.drivers.safety.recovery import Policy
from snakewalk.drivers.types import JointCommand
from tests.campaign.rig import JOINTS, PATIENCE_S, ROBOT, SAFETY, Rig
from tests.campaign.scenarios import CHANGES, NOISE, plan
from tests.campaign.sensors import judge_sensors

PERIOD_S = 0.02
LONGEST_CYCLE_S = PATIENCE_S + 3.0
"""Simulated time that one cycle may take at most: a wait for recovery, and the last try of it."""
_OPERATOR_TRIES = 12
_RESETTING = {"reboot", "brown_out", "unplug", "supply", "remounted", "other robot"}
CHANGING = {*CHANGES, *_RESETTING, "clash"}
"""Kinds after which registers, or who has which ID, may not be as they were set."""
_ALARMS = ("program writes to it", "switched it off", "its mode", "it has rebooted", "exchanged")
"""In the reason of a trip that a changed register has caused."""
_GOAL_ALARMS = ("second master", "ignores sync writes", "writes to it get lost", "goals late")
"""In the reason of a trip that a goal has caused; noise may cause it, too."""
_HARMLESS = {"constant velocity", "jumping velocity", "slow adapter"}
"""Kinds that end no run: they are reported, or need no report."""
_COMMANDED = "commanded nan"
"""In the reason of the only trip that a sound chain has: its commands are not numbers at times."""


@dataclass
class Tally:
    """Sums over scenarios."""

    scenarios: int = 0
    cycles: int = 0
    values: int = 0
    missing: int = 0
    clamped: int = 0
    trips: int = 0
    unsafe_trips: int = 0
    """Trips after which a motor is neither off nor held by its watchdog."""
    brought_back: int = 0
    given_up: int = 0
    """Scenarios ended early: the chain could not be enabled again while the faults last."""
    beyond_limit: int = 0
    too_fast: int = 0
    old: int = 0
    foreign: int = 0
    not_held: int = 0
    raced: int = 0
    """See ``Witness``."""
    too_long: int = 0
    """Cycles that took longer than ``LONGEST_CYCLE_S`` of simulated time."""
    noticed: int = 0
    """Changes of a joint's register, or ID, that the chain has named."""
    unnoticed: int = 0
    ended_otherwise: int = 0
    """Changes that nothing named before a trip or a recovery that had another reason."""
    false_alarms: int = 0
    """Trips that name such a change in a scenario that has none."""
    complaints: list[str] = field(default_factory=list)

    @property
    def violations(self) -> int:
        """What must be zero."""
        values = (self.beyond_limit, self.too_fast, self.old, self.foreign, self.not_held)
        return sum(values) + self.too_long + self.unsafe_trips + self.unnoticed + self.false_alarms

    def add(self, other: "Tally") -> None:
        """Add another's counts."""
        for each in fields(self):
            setattr(self, each.name, getattr(self, each.name) + getattr(other, each.name))


def run_scenario(kinds: tuple[str, ...], seed: int, cycles: int) -> Tally:
    """Swing the joints for ``cycles`` cycles while the faults happen.

    Commands are sane, wild now and then, and once in a while no number at all. After a trip an
    operator looks at the chain and enables it again.
    """
    policy: Policy = "resume" if seed % 2 else "stop"
    faults = plan(kinds, seed, cycles * PERIOD_S)
    rig = Rig(faults, policy)
    trips: list[tuple[float, str]] = []
    tally = Tally(scenarios=1)
    rng = random.Random(seed)
    clock = rig.line.clock
    if not _operator(rig):
        tally.given_up += 1
        cycles = 0
    next_s = clock.now_s()
    while tally.cycles < cycles:
        clock.sleep_until_s(next_s)
        started_s = clock.now_s()
        tally.cycles += 1
        try:
            state = rig.read()
            tally.values += int(state.valid.sum())
            tally.missing += int((~state.valid).sum())
            rig.link.write(JointCommand(clock.now_s(), _goal(rng, clock.now_s())))
            verdict = rig.link.last_verdict
            tally.clamped += 0 if verdict is None else int(verdict.clamped.any())
        except SafetyTrippedError:
            tally.trips += 1
            trips.append((clock.now_s(), str(rig.link.tripped)))
            rig.changes.end(rig.link)
            if _is_false_alarm(kinds, str(rig.link.tripped)):
                tally.false_alarms += 1
                tally.complaints.append(f"{kinds} {seed}: false alarm: {rig.link.tripped}")
            tally.too_long += clock.now_s() - started_s > LONGEST_CYCLE_S
            clock.advance(SAFETY.watchdog_s + 0.02)
            if not rig.safe:
                tally.unsafe_trips += 1
                tally.complaints.append(f"{kinds} {seed}: not safe after: {rig.link.tripped}")
            if not _operator(rig):
                tally.given_up += 1
                break
        else:
            tally.too_long += clock.now_s() - started_s > LONGEST_CYCLE_S
        next_s = max(next_s + PERIOD_S, clock.now_s())
    tally.brought_back = rig.link.recoveries
    if not kinds and rig.changes.reports:
        tally.false_alarms += len(rig.changes.reports)
        tally.complaints += [f"{kinds} {seed}: false alarm: {x}" for x in rig.changes.reports]
    tally.unnoticed = len(rig.changes.unnoticed)
    tally.complaints += [f"{kinds} {seed}: {line}" for line in rig.changes.unnoticed]
    for name in ("noticed", "ended_otherwise"):
        setattr(tally, name, getattr(rig.changes, name))
    if len(kinds) == 1:
        sensors = judge_sensors(faults, rig.changes.reports, trips, clock.now_s())
        tally.noticed += sensors.noticed
        tally.ended_otherwise += sensors.ended_otherwise
        tally.unnoticed += len(sensors.unnoticed)
        tally.complaints += [f"{kinds} {seed}: {line}" for line in sensors.unnoticed]
    for name in ("beyond_limit", "too_fast", "old", "foreign", "not_held", "raced"):
        setattr(tally, name, getattr(rig.witness, name))
    tally.complaints += [f"{kinds} {seed}: {line}" for line in rig.witness.complaints]
    with suppress(DriverError):
        rig.link.disable()
    return tally


def campaign(
    scenarios: Iterable[tuple[tuple[str, ...], int]],
    cycles: int,
    told: Callable[[], None] = lambda: None,
) -> tuple[Tally, dict[str, Tally]]:
    """Run all; the sum, and the sum by kind of fault (a pair counts for both)."""
    whole, by_kind = Tally(), {}
    for kinds, seed in scenarios:
        one = run_scenario(kinds, seed, cycles)
        whole.add(one)
        for kind in kinds or ("none",):
            by_kind.setdefault(kind, Tally()).add(one)
        told()
    return whole, by_kind


def _is_false_alarm(kinds: tuple[str, ...], reason: str) -> bool:
    """Whether a trip of a scenario names what none of its faults can cause."""
    if not kinds:
        return _COMMANDED not in reason
    if len(kinds) == 1 and kinds[0] in _HARMLESS:
        return _COMMANDED not in reason
    changing = CHANGING | {"constant position", "jumping position"}  # as IDs that are exchanged
    alarms = () if changing & set(kinds) else _ALARMS
    if not (CHANGING | {*NOISE, "lost writes"}) & set(kinds):
        alarms += _GOAL_ALARMS
    if kinds == ("dip",):
        alarms += ("supply too low",)
    return any(each in reason for each in alarms)


def _goal(rng: random.Random, time_s: float) -> np.ndarray:
    draw = rng.random()
    goal = 0.5 * np.sin(2.5 * time_s + np.arange(JOINTS))
    if draw < 0.0005:
        goal[rng.randrange(JOINTS)] = np.nan
    elif draw < 0.03:
        goal[rng.randrange(JOINTS)] = rng.uniform(-4.0, 4.0)
    return goal


def _operator(rig: Rig) -> bool:
    """Somebody lets it cool down, reboots what has an alarm, enables; whether it runs again."""
    for _ in range(_OPERATOR_TRIES):
        rig.cool_down()
        try:
            if not rig.line.is_open:
                reopen(rig.line)
            for servo_id in ROBOT.servo_ids:
                if rig.bus.read(servo_id, "Hardware Error Status"):
                    rig.bus.reboot(servo_id)
        except PortError:
            rig.line.clock.advance(0.3)
            continue
        except DriverError:
            rig.line.clock.advance(0.3)
        rig.line.clock.advance(0.3)
        rig.restart()
        try:
            rig.link.reset("campaign")
            rig.link.enable()
        except DriverError:
            rig.line.clock.advance(0.3)
            continue
        return True
    return False
