"""Plays a fault file on a simulated line: same file, same seed, same run, same bytes."""

import random
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from config import faults as plan
from config.errors import ConfigError
from sim.bus.line import SimLine
from sim.bus.noise import Noise
from sim.bus.protection import (
    ENCODER_ERROR,
    OVERHEATING_ERROR,
    OVERLOAD_ERROR,
    SHOCK_ERROR,
    VOLTAGE_ERROR,
)

Rows = NDArray[np.intp]

_TRIPS = {
    "overload": OVERLOAD_ERROR,
    "overheating": OVERHEATING_ERROR,
    "voltage": VOLTAGE_ERROR,
    "encoder": ENCODER_ERROR,
    "shock": SHOCK_ERROR,
}


class FaultPlayer:
    """Faults of a plan on ``line``, from its present time on.

    Raises:
        ConfigError: the plan names an ID that no servo of the line has.

    """

    def __init__(self, line: SimLine, faults: plan.FaultPlan, source: str = "faults") -> None:
        self._line = line
        self._firmware = line.firmware
        self._start_s = line.clock.now_s()
        self._rows = {int(servo): row for row, servo in enumerate(line.bank["ID"])}
        self._check(faults, source)
        self.noise = Noise(random.Random(faults.seed), self._start_s)
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

    def host_wakes_s(self, now_s: float) -> float:
        """When a host that wants to go on at ``now_s`` does."""
        while self.stalls and self.stalls[0][0] <= now_s:
            begin_s, for_s = self.stalls.pop(0)
            now_s = max(now_s, begin_s + for_s)
        return now_s

    # planning

    def _check(self, faults: plan.FaultPlan, source: str) -> None:
        wrong = []
        for k, fault in enumerate(faults.fault):
            named = list(getattr(fault, "ids", ()))
            named += [
                getattr(fault, key) for key in ("id", "takes", "behind") if hasattr(fault, key)
            ]
            wrong += [
                f"{source}: fault.{k}.{fault.kind}: no servo has ID {each}; the bus has "
                f"{', '.join(map(str, sorted(self._rows)))}"
                for each in named
                if each not in self._rows
            ]
        if wrong:
            raise ConfigError(wrong)

    def _plan(self, fault: plan.Fault) -> None:
        begin, end = self._deeds(fault)
        self._firmware.agenda.plan(self._start_s + fault.at_s, self._known(begin))
        for_s = getattr(fault, "for_s", None)
        if end is not None and for_s is not None:
            self._firmware.agenda.plan(self._start_s + fault.at_s + for_s, self._known(end))

    def _known(self, deed: Callable[[], None]) -> Callable[[], None]:
        """A deed after which the line looks again at who is there."""

        def act() -> None:
            deed()
            self._line.look_again()

        return act

    def _deeds(self, fault: plan.Fault) -> tuple[Callable[[], None], Callable[[], None] | None]:
        """What to do at the beginning and at the end."""
        line, firmware = self._line, self._firmware
        rows = np.array([self._rows[each] for each in getattr(fault, "ids", ())], np.intp)
        if isinstance(fault, plan.Port):
            return line.vanish, line.come_back
        if isinstance(fault, plan.Supply):
            usual = firmware.protection.supply_v
            return (
                lambda: firmware.protection.supply(fault.volts),
                lambda: firmware.protection.supply(usual),
            )
        if isinstance(fault, plan.Unplug):
            behind = np.arange(self._rows[fault.behind] + 1, len(line.bank))
            return lambda: firmware.cut_power(behind), lambda: firmware.give_power(behind)
        if isinstance(fault, plan.Clash):
            row = self._rows[fault.id]
            return lambda: self._set_id(row, fault.takes), lambda: self._set_id(row, fault.id)
        if isinstance(fault, plan.Heat):
            return lambda: firmware.protection.heat(rows, fault.celsius), None
        if isinstance(fault, plan.Trip):
            return lambda: self._trip(rows, fault.kind), None
        return self._servo_deeds(fault, rows)

    def _servo_deeds(
        self, fault: plan.Fault, rows: Rows
    ) -> tuple[Callable[[], None], Callable[[], None]]:
        firmware = self._firmware
        if fault.kind == "mute":
            return lambda: self._mute(rows, True), lambda: self._mute(rows, False)
        if fault.kind == "stuck":
            return lambda: firmware.seize(rows), lambda: firmware.release(rows)
        return lambda: firmware.cut_power(rows), lambda: firmware.give_power(rows)

    # deeds

    def _mute(self, rows: Rows, on: bool) -> None:
        self._line.roll.mute[rows] = on

    def _set_id(self, row: int, servo_id: int) -> None:
        self._line.bank["ID"][row] = servo_id

    def _trip(self, rows: Rows, kind: str) -> None:
        if kind == "reboot":
            for row in rows:
                self._firmware.reboot(int(row))
        else:
            self._firmware.protection.detect(rows, _TRIPS[kind])
