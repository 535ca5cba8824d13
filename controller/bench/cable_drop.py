"""Voltage drop of the cables along a chain, and the best place for another supply lead.

Voltages under load give the resistance of each cable. A ladder of these cables predicts the effect
of another lead.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.robot import PowerConfig, RobotConfig
from snakewalk.controller.console.finding import Finding
from snakewalk.drivers.protocol.registers import VOLTAGE_UNIT_V
from snakewalk.sim.servo.motor import motors_of
from snakewalk.sim.servo.supply import SOURCE_OHM, Cabling

CHECK = "cables"
CONTACT_LIMIT_A = 3.0
"""Limit of a contact of the JST EH connector of the X series with AWG 22 (JST's data sheet)."""
DROP_SHARE = 0.04
"""Share of the supply that may drop along the chain (ours): 0.5 V of 12 V."""
_BLOCKS = 8
"""Parts of a measurement whose scatter is the error of the whole."""
_SIDES = 2.4
"""Half an interval in standard errors: Student's t for 8 blocks, 95 %."""
_BAD_TIMES = 3.0
"""A cable is bad if its resistance is this multiple of the others' and of a new one's (ours)."""
_BAD_DROP_V = 0.1
"""... and if its drop exceeds theirs by this: two servos may measure differently by less (ours)."""
_BAD_ERRORS = 3.0
"""Difference of a bad cable's drop in standard errors (ours)."""
_LINE = 5
"""Cables between two leads from which on it is asked how those share the current (ours)."""
_LEAST_CABLE_CURRENT_A = 1e-3
"""A smaller current does not allow an estimate of a cable."""


@dataclass(frozen=True, slots=True)
class CableEstimate:
    """Resistance of the cables of a chain of S servos, with 95 % intervals, ohm."""

    cable_ohm: Floats
    """(S - 1,) of each; NaN if no current allowed an estimate."""
    low_ohm: Floats
    high_ohm: Floats
    usual_ohm: float
    """Usual resistance: that of most cables."""
    usual_low_ohm: float
    usual_high_ohm: float
    bad: tuple[int, ...]
    """Cables with a far higher resistance than the others."""

    def cabling(self, leads: Cabling) -> Cabling:
        """Cables as estimated, all but the bad ones as usual; leads as given."""
        cables_ohm = np.full(len(self.cable_ohm), max(self.usual_ohm, 1e-4))
        cables_ohm[list(self.bad)] = self.cable_ohm[list(self.bad)]
        return replace(leads, cable_ohm=cables_ohm)


@dataclass(frozen=True, slots=True)
class Injection:
    """Places of additional leads, and the lowest voltage of a servo with them."""

    servo_ids: tuple[int, ...]
    lowest_v: float


def estimate_cables(voltage_v: Floats, drawn_a: Floats, leads: Cabling) -> CableEstimate:
    """Estimate the cables from T readings of S servos under load.

    The mean step of the voltage over a cable is the mean current in it times its resistance. The
    currents of the servos give it (Kirchhoff). The median of all reveals a bad cable; the others'
    resistance is their mean, weighted by the current.

    Args:
        voltage_v: (T, S) in steps of 0.1 V.
        drawn_a: (T, S) from the supply.
        leads: where power comes in; of its cables nothing is used.

    """
    step_v = -np.diff(voltage_v, axis=1)
    errors_v = np.hypot(_block_error(step_v), np.hypot(*_rounding_errors(voltage_v)))
    mean_v = step_v.mean(axis=0)
    flow_a, error_a = _flow(mean_v, errors_v, drawn_a.mean(axis=0), np.isfinite(leads.lead_ohm))
    size_a = np.maximum(np.abs(flow_a), _LEAST_CABLE_CURRENT_A)
    ohm = mean_v * np.sign(flow_a) / size_a
    error_ohm = np.hypot(errors_v, ohm * error_a) / size_a
    middle_ohm = max(_weighted_median(ohm, size_a), 0.0)
    surely_ohm = ohm - _SIDES * error_ohm
    limit_ohm = _BAD_TIMES * max(middle_ohm, PowerConfig().cable_ohm)
    extra_v = (ohm - middle_ohm) * size_a
    surely_v = np.maximum(_BAD_DROP_V, _BAD_ERRORS * np.hypot(errors_v, middle_ohm * error_a))
    bad = tuple(
        int(k)
        for k in np.flatnonzero((ohm > limit_ohm) & (extra_v > surely_v))
        if _step_stays(mean_v * np.sign(flow_a), int(k))
    )
    alike = surely_ohm <= 2.0 * middle_ohm  # a doubtful one is neither named nor counted
    weight = size_a * alike
    usual_ohm = float(weight @ ohm / weight.sum())
    # errors of neighbours cancel, those of a current between two leads do not
    spread_ohm = np.linalg.norm(weight * errors_v / size_a) / weight.sum()
    spread_ohm = np.hypot(spread_ohm, weight @ np.abs(ohm * error_a / size_a) / weight.sum())
    reach_ohm = _SIDES * float(spread_ohm)
    return CableEstimate(
        ohm,
        np.maximum(surely_ohm, 0.0),
        ohm + _SIDES * error_ohm,
        max(usual_ohm, 0.0),
        max(usual_ohm - reach_ohm, 0.0),
        usual_ohm + reach_ohm,
        bad,
    )


def _flow(step_v: Floats, error_v: Floats, drawn_a: Floats, fed: Bools) -> tuple[Floats, Floats]:
    """Current in each cable, positive away from the first servo, and its standard error, (S - 1,).

    Outside the leads it is the current of the servos beyond. Between two leads of equal cables, the
    voltage step falls by the servo's current times the resistance, so no current flows where the
    step is 0. Line and slope are medians (Theil, Sen), which a bad cable does not move.
    """
    passed_a = np.cumsum(drawn_a)[:-1]  # of all servos up to the cable
    rows = np.flatnonzero(fed)
    flow_a, error_a = -passed_a, np.zeros(len(step_v))
    flow_a[rows[-1] :] = drawn_a.sum() - passed_a[rows[-1] :]
    for front, back in pairwise(rows):
        between = slice(front, back)
        inner_a = passed_a[between] - passed_a[front]
        share_a = float(np.median(inner_a))  # evenly, as cables do that are all alike
        if back - front >= _LINE:
            first, second = np.triu_indices(int(back - front), 1)
            run_a = inner_a[second] - inner_a[first]
            fall_v = step_v[between][first] - step_v[between][second]
            slope_ohm = max(_weighted_median(fall_v / run_a, run_a), 1e-3)
            share_a = float(np.median(step_v[between] / slope_ohm + inner_a))
            error = float(np.median(error_v[between])) / slope_ohm / np.sqrt(back - front)
            error_a[between] = 1.25 * error  # of a median
        flow_a[between] = share_a - inner_a
    return flow_a, error_a


def best_injection(
    cabling: Cabling,
    servo_ids: Sequence[int],
    source_v: float,
    drawn_a: Floats,
    count: int = 1,
) -> Injection:
    """Place ``count`` more leads for the highest possible lowest voltage.

    Args:
        cabling: cables, and the leads that there are.
        servo_ids: (S,) in the order of the chain.
        source_v: of the supply without load.
        drawn_a: (S,) that the servos go on drawing.
        count: of leads, each as thick as those that there are.

    """
    new_ohm = float(cabling.lead_ohm.min())
    free = np.flatnonzero(np.isinf(cabling.lead_ohm)).tolist()
    best = Injection((), -np.inf)
    for rows in combinations(free, min(count, len(free))):
        lead_ohms = cabling.lead_ohm.copy()
        lead_ohms[list(rows)] = new_ohm
        servo_v = replace(cabling, lead_ohm=lead_ohms).servo_v(source_v, SOURCE_OHM, drawn_a)
        if servo_v.min() > best.lowest_v + 1e-9:
            best = Injection(tuple(servo_ids[row] for row in rows), float(servo_v.min()))
    return best


class Drop(NamedTuple):
    """A chain of S servos under a load."""

    servo_v: Floats
    """(S,) supply voltage at each servo, V."""
    drawn_a: Floats
    """(S,) current of each servo from the supply, A."""
    cable_a: Floats
    """(S - 1,) in each cable, positive away from the first servo."""


def drop_along(robot: RobotConfig, power: PowerConfig, current_a: float) -> Drop:
    """Voltages if each servo draws ``current_a``, in addition to its electronics."""
    cabling = Cabling.of(robot, power)
    load_a = current_a + _standby_a(robot)
    servo_v = cabling.servo_v(robot.servo.supply_v, SOURCE_OHM, load_a)
    return Drop(servo_v, load_a, cabling.cable_a(servo_v))


def leads_of(robot: RobotConfig, voltage_v: Floats) -> tuple[Cabling, str]:
    """Leads of the robot's file, or one at the end with the higher voltage.

    Args:
        robot: with or without a table ``[power]``.
        voltage_v: (S,) under load.

    Returns:
        Cables of the file or new ones; a note if the file has none.

    """
    if robot.power is not None:
        return Cabling.of(robot, robot.power), ""
    end = robot.servo_ids[0] if voltage_v[0] >= voltage_v[-1] else robot.servo_ids[-1]
    power = PowerConfig(inject_ids=(end,))
    return Cabling.of(robot, power), f"; assumed: power enters at ID {end}"


def cable_finding(robot: RobotConfig, voltage_v: Floats, drawn_a: Floats) -> Finding:
    """Judge the voltage along the chain under load.

    Args:
        robot: its IDs, and where its file says that power comes in.
        voltage_v: (T, S) measured, T of 1 or more.
        drawn_a: (T, S) from the supply, measured at the same times; NaN where nobody measures it.

    """
    ids = robot.servo_ids
    supply_v = robot.servo.supply_v
    worst = np.argsort(voltage_v.min(axis=1))[: max(len(voltage_v) // 10, 1)]
    loaded_v = voltage_v[worst].mean(axis=0)
    high, low = int(np.argmax(loaded_v)), int(np.argmin(loaded_v))
    fall_v = float(loaded_v[high] - loaded_v[low])
    shown = f"{loaded_v[high]:.1f} V at ID {ids[high]} to {loaded_v[low]:.1f} V at ID {ids[low]}"
    if len(ids) < 2 or not np.isfinite(drawn_a).all() or len(voltage_v) < _BLOCKS:
        voltage_text = f"voltage from {shown} under load"
        if fall_v > DROP_SHARE * supply_v:
            return Finding(CHECK, "warn", voltage_text, "feed the chain at both ends")
        return Finding(CHECK, "ok", voltage_text)
    leads, note = leads_of(robot, voltage_v.mean(axis=0))
    estimate = estimate_cables(voltage_v, drawn_a, leads)
    cabling = estimate.cabling(leads)
    load_a = drawn_a[worst].mean(axis=0)
    bad = [
        f"the one between servos {ids[k]} and {ids[k + 1]} has {estimate.cable_ohm[k]:.2f} ohm "
        f"({estimate.low_ohm[k]:.2f} to {estimate.high_ohm[k]:.2f})"
        for k in estimate.bad
    ]
    cables = (
        f"cables of {estimate.usual_ohm:.3f} ohm "
        f"({estimate.usual_low_ohm:.3f} to {estimate.usual_high_ohm:.3f}){note}"
    )
    if bad:
        voltage_text = f"{'; '.join(bad)}; the others: {cables}; {shown} under load"
        return Finding(
            CHECK, "fail", voltage_text, "reseat its plugs, or exchange it; then run it again"
        )
    if fall_v <= DROP_SHARE * supply_v:
        return Finding(CHECK, "ok", f"at most {fall_v:.1f} V between two servos under load")
    # the source that makes what was measured, through the same cables
    source_v = float((loaded_v - cabling.servo_v(0.0, SOURCE_OHM, load_a)).mean())
    voltage_text = f"voltage falls from {shown} under load; {cables}"
    return Finding(CHECK, "warn", voltage_text, advice(cabling, ids, source_v, load_a))


def advice(cabling: Cabling, servo_ids: Sequence[int], source_v: float, drawn_a: Floats) -> str:
    """Where to inject power: ``inject power at ID 9: 11.2 V at the lowest; at IDs 6, 13: ...``."""
    best_single, two = (
        best_injection(cabling, servo_ids, source_v, drawn_a, count) for count in (1, 2)
    )
    if not best_single.servo_ids:
        return "each servo has a lead of its own: shorter or thicker ones; a stronger supply"
    text = (
        f"inject power at ID {best_single.servo_ids[0]}: {best_single.lowest_v:.1f} V at the lowest"
    )
    if two.lowest_v > best_single.lowest_v + VOLTAGE_UNIT_V:
        shown = " and ".join(map(str, two.servo_ids))
        text += f"; at IDs {shown}: {two.lowest_v:.1f} V"
    return text


def drawn_a(robot: RobotConfig, duty: Floats, current_a: Floats) -> Floats:
    """Supply current of servos, A: bridges and electronics.

    Args:
        robot: its models.
        duty: (..., S) output of the bridges, -1 to 1.
        current_a: (..., S) in the windings.

    Returns:
        (..., S); NaN of servos without a current sensor.

    """
    measured = [facts.units.current_a is not None for facts in robot.servo_records]
    return np.where(measured, np.abs(duty * current_a), np.nan) + _standby_a(robot)


def _standby_a(robot: RobotConfig) -> Floats:
    """(S,) what the electronics of the servos draw (e-manual, "Standby Current")."""
    return np.array([motor.standby_a for motor in motors_of(robot)])


def _step_stays(step_v: Floats, cable: int) -> bool:
    """Whether the voltage stays down behind a cable.

    A servo with a wrong reading makes one step down and the next one up.
    """
    neighbours_v = [step_v[k] for k in (cable - 1, cable + 1) if 0 <= k < len(step_v)]
    return all(neighbour_v > -0.5 * step_v[cable] for neighbour_v in neighbours_v)


def _block_error(values: Floats) -> Floats:
    means = np.stack([block.mean(axis=0) for block in np.array_split(values, _BLOCKS)])
    return np.asarray(means.std(axis=0, ddof=1) / np.sqrt(_BLOCKS))


def _rounding_errors(voltage_v: Floats) -> tuple[Floats, Floats]:
    """Errors of the means before and behind each cable from rounding to 0.1 V.

    A changing reading averages the rounding; a constant one may be off by all of it.
    """
    changes = (np.diff(voltage_v, axis=0) != 0.0).sum(axis=0)
    error_v = VOLTAGE_UNIT_V / np.sqrt(12.0) / np.sqrt(1.0 + changes)
    return error_v[:-1], error_v[1:]


def _weighted_median(values: Floats, weights: Floats) -> float:
    order = np.argsort(values)
    reached = np.cumsum(weights[order]) >= 0.5 * weights.sum()
    return float(values[order][np.argmax(reached)])
