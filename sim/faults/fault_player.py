"""Plays a fault file on a simulated line; file and seed determine the bytes."""

import math
import random
from collections.abc import Callable, Collection
from functools import partial
from typing import Protocol, assert_never

import numpy as np

from snakewalk.config import faults as plan
from snakewalk.config.arrays import Indices
from snakewalk.config.errors import ConfigError
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.noise import FaultScript, Noise
from snakewalk.sim.servo.simulated_servos import FaultyServos

_Actions = tuple[Callable[[], None], Callable[[], None] | None]
"""Actions at the beginning and at the end of a fault; None: the fault does not end."""
_ID_KEYS = ("id", "takes", "behind")
"""Keys of a fault that name one servo."""


class FaultTarget(Protocol):
    """A line of either protocol, and its servos."""

    clock: SimClock
    has_alert_bit: bool
    """Whether replies have a bit that reports an error without its cause."""

    @property
    def servos(self) -> FaultyServos:
        """IDs of a fault that are on the line."""
        ...

    def ids(self) -> list[int]:
        """The ID of each row."""
        ...

    def senders(self, reply: bytes) -> Collection[int]:
        """IDs of the servos that sent a reply."""
        ...

    def rename(self, row: int, servo_id: int) -> None:
        """Give a servo another ID."""
        ...

    def register_type(self, row: int, name: str) -> np.dtype[np.integer] | None:
        """Type of a register's numbers; None if a servo lacks it."""
        ...

    def write_register(self, rows: Indices, name: str, value: int) -> None:
        """Set a register of servos, like another program."""
        ...

    def mute(self, rows: Indices, on: bool) -> None:
        """Suppress or restore the replies of servos."""
        ...

    def deafen(self, rows: Indices, on: bool) -> None:
        """Let servos ignore sync writes, or accept them again."""
        ...

    def set_alert(self, rows: Indices, on: bool) -> None:
        """Set or clear a false alert bit in the replies of servos."""
        ...

    def refresh_ids(self) -> None:
        """Look the IDs up again after a change of IDs, power or muting."""
        ...

    def disconnect(self) -> None:
        """Disconnect the port from the host."""
        ...

    def reconnect(self) -> None:
        """Reconnect the port."""
        ...

    def attach(self, script: FaultScript) -> None:
        """Let a script change packets and pause the host."""
        ...


class FaultPlayer:
    """Runs the faults of a plan on ``line``, from its present time.

    Raises:
        ConfigError: the plan has an unknown ID, or an error that its servos cannot detect.

    """

    def __init__(self, line: FaultTarget, faults: plan.FaultPlan, source: str = "faults") -> None:
        self._line = line
        self._servos = line.servos
        self._start_s = line.clock.now_s()
        self._rows = {servo: row for row, servo in enumerate(line.ids())}
        self.noise = Noise(random.Random(faults.seed), self._start_s, line.senders)
        self.stalls: list[tuple[float, float]] = []
        """Pauses of the host: begin on the line's clock, and length, s."""
        self._add(faults, source)
        line.attach(self)

    def add(self, faults: plan.FaultPlan, source: str = "faults") -> None:
        """Add faults with times from now; raises as the constructor."""
        since_s = self._line.clock.now_s() - self._start_s
        later = [fault.model_copy(update={"at_s": fault.at_s + since_s}) for fault in faults.fault]
        self._add(faults.model_copy(update={"fault": tuple(later)}), source)

    def _add(self, faults: plan.FaultPlan, source: str) -> None:
        self._check(faults, source)
        for fault in faults.fault:
            if isinstance(fault, plan.NoiseFault):
                self.noise.add(fault)
            elif isinstance(fault, plan.StallFault):
                self.stalls.append((self._start_s + fault.at_s, fault.for_s))
            else:
                self._schedule(fault)
        self.stalls.sort()

    def host_resumes_s(self, now_s: float) -> float:
        """Time at which a host that calls at ``now_s`` continues."""
        while self.stalls and self.stalls[0][0] <= now_s:
            begin_s, for_s = self.stalls.pop(0)
            now_s = max(now_s, begin_s + for_s)
        return now_s

    # schedule

    def _check(self, faults: plan.FaultPlan, source: str) -> None:
        wrong: list[str] = []
        there = ", ".join(map(str, sorted(self._rows)))
        for k, fault in enumerate(faults.fault):
            where = f"{source}: fault.{k}.{fault.kind}"
            named = list(getattr(fault, "ids", ()))
            named += [getattr(fault, key) for key in _ID_KEYS if hasattr(fault, key)]
            wrong += [
                f"{where}: no servo has ID {servo_id}; the bus has {there}"
                for servo_id in named
                if servo_id not in self._rows
            ]
            if isinstance(fault, plan.WriteFault | plan.ReadingFault):
                wrong += self._unwritable(fault, where)
            if fault.kind == "alert" and not self._line.has_alert_bit:
                wrong.append(f"{where}: replies of Protocol 1.0 and of Feetech have no alert bit")
            if isinstance(fault, plan.TripFault) and fault.kind != "reboot":
                wrong += self._undetectable(fault, where)
        if wrong:
            raise ConfigError(wrong)

    def _unwritable(self, fault: plan.WriteFault | plan.ReadingFault, where: str) -> list[str]:
        """Messages about a register that a servo lacks, or a value that does not fit."""
        wrong = []
        for servo_id in self._rows.keys() & set(fault.ids):
            name = fault.register_name
            value = fault.value
            kind = self._line.register_type(self._rows[servo_id], name)
            if kind is None:
                wrong.append(f"{where}: servo {servo_id} has no register {name}")
            elif value is not None and not np.iinfo(kind).min <= value <= np.iinfo(kind).max:
                span = f"{np.iinfo(kind).min} to {np.iinfo(kind).max}"
                wrong.append(f"{where}: {name} of servo {servo_id} holds {span}, not {value}")
        return wrong

    def _undetectable(self, fault: plan.TripFault, where: str) -> list[str]:
        """Messages about an error that a servo cannot detect."""
        alarms_by_id = {
            servo_id: self._servos.protection.alarms(self._rows[servo_id])
            for servo_id in fault.ids
            if servo_id in self._rows
        }
        return [
            f"{where}: servo {servo_id} detects {', '.join(alarms)} only"
            for servo_id, alarms in alarms_by_id.items()
            if fault.kind not in alarms
        ]

    def _schedule(self, fault: plan.ScheduledFault) -> None:
        begin, end = self._actions(fault)
        self._servos.events.schedule(self._start_s + fault.at_s, self._then_refresh_ids(begin))
        for_s = getattr(fault, "for_s", None)
        if end is not None and for_s is not None:
            self._servos.events.schedule(
                self._start_s + fault.at_s + for_s, self._then_refresh_ids(end)
            )

    def _then_refresh_ids(self, action: Callable[[], None]) -> Callable[[], None]:
        """Action followed by a new look-up of the IDs."""

        def act() -> None:
            action()
            self._line.refresh_ids()

        return act

    def _actions(self, fault: plan.ScheduledFault) -> _Actions:
        line = self._line
        protection = self._servos.protection
        rows = np.array([self._rows[servo_id] for servo_id in getattr(fault, "ids", ())], np.intp)
        match fault:
            case plan.PortFault():
                return line.disconnect, line.reconnect
            case plan.SupplyFault(volts=volts):
                some = rows if len(rows) else None
                return partial(protection.supply, volts, some), partial(
                    protection.supply, None, some
                )
            case plan.UnplugFault(behind=behind):
                return self._power_cut(np.arange(self._rows[behind] + 1, len(line.ids())))
            case plan.ClashFault():
                return partial(self._rename, fault, True), partial(self._rename, fault, False)
            case plan.WriteFault():
                return partial(self._write_again, fault, rows), None
            case plan.ReadingFault(register_name=name, value=value):
                return partial(self._servos.set_reading, rows, name, value), partial(
                    self._servos.clear_reading, rows, name
                )
            case plan.HeatFault(celsius=celsius):
                return partial(protection.heat, rows, celsius), None
            case plan.TripFault(kind=kind):
                return partial(self._trip, rows, kind), None
            case plan.ServoFault():
                return self._servo_actions(fault, rows)
            case unknown:
                assert_never(unknown)

    def _servo_actions(self, fault: plan.ServoFault, rows: Indices) -> _Actions:
        line = self._line
        servos = self._servos
        match fault.kind:
            case "mute":
                return partial(line.mute, rows, True), partial(line.mute, rows, False)
            case "stuck":
                return partial(servos.block_shafts, rows), partial(servos.free_shafts, rows)
            case "no_output":
                return partial(servos.cut_output, rows, True), partial(
                    servos.cut_output, rows, False
                )
            case "brown_out":
                return self._power_cut(rows)
            case "deaf":
                return partial(line.deafen, rows, True), partial(line.deafen, rows, False)
            case "alert":
                return partial(line.set_alert, rows, True), partial(line.set_alert, rows, False)
            case unknown:
                assert_never(unknown)

    def _power_cut(self, rows: Indices) -> _Actions:
        return partial(self._servos.cut_power, rows), partial(self._servos.restore_power, rows)

    def _write_again(self, fault: plan.WriteFault, rows: Indices, count: int = 0) -> None:
        self._line.write_register(rows, fault.register_name, fault.value)
        since_s = (count + 1) * (fault.every_s or math.inf)
        if since_s < (fault.for_s or math.inf):
            again = partial(self._write_again, fault, rows, count + 1)
            self._servos.events.schedule(self._start_s + fault.at_s + since_s, again)

    def _rename(self, fault: plan.ClashFault, begins: bool) -> None:
        new, old = (fault.takes, fault.id) if begins else (fault.id, fault.takes)
        self._line.rename(self._rows[fault.id], new)
        if fault.kind == "exchange":
            self._line.rename(self._rows[fault.takes], old)

    def _trip(self, rows: Indices, kind: str) -> None:
        if kind == "reboot":
            for row in rows:
                self._servos.reboot(int(row))
        else:
            protection = self._servos.protection
            protection.detect(rows, protection.alarms(int(rows[0]))[kind])
