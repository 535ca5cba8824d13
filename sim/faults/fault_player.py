"""Plays a fault file on a simulated line: same file, same seed, same run, same bytes."""

import random
from collections.abc import Callable

import numpy as np

from snakewalk.config import faults as plan
from snakewalk.config.arrays import Indices
from snakewalk.config.errors import ConfigError
from snakewalk.sim.faults.fault_target import FaultTarget
from snakewalk.sim.line.noise import Noise

_NAMES = ("id", "takes", "behind")
"""Keys of a fault that name one servo."""


class FaultPlayer:
    """Faults of a plan on ``line``, from its present time on.

    Raises:
        ConfigError: the plan names an ID that no servo of the line has, or an error that its servos
            cannot detect.

    """

    def __init__(self, line: FaultTarget, faults: plan.FaultPlan, source: str = "faults") -> None:
        self._line = line
        self._servos = line.servos
        self._start_s = line.clock.now_s()
        self._rows = {servo: row for row, servo in enumerate(line.ids())}
        self._check(faults, source)
        self.noise = Noise(random.Random(faults.seed), self._start_s, line.senders)
        self.stalls: list[tuple[float, float]] = []
        """When the host stands still, and for how long; times of the line's clock."""
        for fault in faults.fault:
            if isinstance(fault, plan.Noise):
                self.noise.add(fault)
            elif isinstance(fault, plan.Stall):
                self.stalls.append((self._start_s + fault.at_s, fault.for_s))
            else:
                self._plan(fault)
        self.stalls.sort()
        line.attach(self)

    def host_resumes_s(self, now_s: float) -> float:
        """When a host that wants to go on at ``now_s`` does."""
        while self.stalls and self.stalls[0][0] <= now_s:
            begin_s, for_s = self.stalls.pop(0)
            now_s = max(now_s, begin_s + for_s)
        return now_s

    # planning

    def _check(self, faults: plan.FaultPlan, source: str) -> None:
        wrong: list[str] = []
        there = ", ".join(map(str, sorted(self._rows)))
        for k, fault in enumerate(faults.fault):
            where = f"{source}: fault.{k}.{fault.kind}"
            named = list(getattr(fault, "ids", ()))
            named += [getattr(fault, key) for key in _NAMES if hasattr(fault, key)]
            wrong += [
                f"{where}: no servo has ID {each}; the bus has {there}"
                for each in named
                if each not in self._rows
            ]
            if isinstance(fault, plan.Trip) and fault.kind != "reboot":
                wrong += self._undetectable(fault, where)
        if wrong:
            raise ConfigError(wrong)

    def _undetectable(self, fault: plan.Trip, where: str) -> list[str]:
        """What is wrong with an error that a servo named cannot detect."""
        known = {
            each: self._servos.protection.alarms(self._rows[each])
            for each in fault.ids
            if each in self._rows
        }
        return [
            f"{where}: servo {each} detects {', '.join(alarms)} only"
            for each, alarms in known.items()
            if fault.kind not in alarms
        ]

    def _plan(self, fault: plan.Fault) -> None:
        begin, end = self._actions(fault)
        self._servos.events.schedule(self._start_s + fault.at_s, self._then_refresh_ids(begin))
        for_s = getattr(fault, "for_s", None)
        if end is not None and for_s is not None:
            self._servos.events.schedule(
                self._start_s + fault.at_s + for_s, self._then_refresh_ids(end)
            )

    def _then_refresh_ids(self, action: Callable[[], None]) -> Callable[[], None]:
        """Action after which the line looks up again who has which ID."""

        def act() -> None:
            action()
            self._line.refresh_ids()

        return act

    def _actions(self, fault: plan.Fault) -> tuple[Callable[[], None], Callable[[], None] | None]:
        """What to do at the beginning and at the end."""
        line, servos = self._line, self._servos
        guard = servos.protection
        rows = np.array([self._rows[each] for each in getattr(fault, "ids", ())], np.intp)
        if isinstance(fault, plan.Port):
            return line.disconnect, line.reconnect
        if isinstance(fault, plan.Supply):
            some = rows if len(rows) else None
            return lambda: guard.supply(fault.volts, some), lambda: guard.supply(None, some)
        if isinstance(fault, plan.Unplug):
            behind = np.arange(self._rows[fault.behind] + 1, len(line.ids()))
            return lambda: servos.cut_power(behind), lambda: servos.restore_power(behind)
        if isinstance(fault, plan.Clash):
            row = self._rows[fault.id]
            return lambda: line.rename(row, fault.takes), lambda: line.rename(row, fault.id)
        if isinstance(fault, plan.Heat):
            return lambda: guard.heat(rows, fault.celsius), None
        if isinstance(fault, plan.Trip):
            return lambda: self._trip(rows, fault.kind), None
        return self._servo_actions(fault, rows)

    def _servo_actions(
        self, fault: plan.Fault, rows: Indices
    ) -> tuple[Callable[[], None], Callable[[], None]]:
        line, servos = self._line, self._servos
        if fault.kind == "mute":
            return lambda: line.mute(rows, True), lambda: line.mute(rows, False)
        if fault.kind == "stuck":
            return lambda: servos.block_shafts(rows), lambda: servos.free_shafts(rows)
        return lambda: servos.cut_power(rows), lambda: servos.restore_power(rows)

    def _trip(self, rows: Indices, kind: str) -> None:
        if kind == "reboot":
            for row in rows:
                self._servos.reboot(int(row))
        else:
            guard = self._servos.protection
            guard.detect(rows, guard.alarms(int(rows[0]))[kind])
