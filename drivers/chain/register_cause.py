"""Cause of changed registers: all of a servo's are read together before one is named."""

from collections.abc import Mapping, Sequence

from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.chain.fingerprint import register_change
from snakewalk.drivers.protocol.registers import WATCHDOG, WATCHDOG_TRIPPED

TORQUE = "Torque Enable"
"""The first register in RAM: a restart sets it, and those behind it, to their initial values."""
MODE = "Operating Mode"
_COPIES = "Goal PWM", "Goal Current"
"""Registers to which a restart copies a limit from the EEPROM."""
_SHOWN = 3
"""Number of changed registers that a message lists (ours)."""


def register_cause(
    facts: ServoModel,
    expected: Mapping[str, int],
    values: Mapping[str, int],
    rad_per_position: float,
) -> str | None:
    """Changed registers of one servo and their cause, or None.

    ``values`` were read at one time; ``expected`` has the same registers.
    """
    names = dict.fromkeys((TORQUE, MODE, *values))
    changed = [name for name in names if values.get(name) != expected.get(name)]
    if not changed:
        return None
    if values.get(WATCHDOG) == WATCHDOG_TRIPPED:
        return "its bus watchdog has stopped it: no packet reached it in time; check its plugs"
    texts = [
        "torque is off"
        if name == TORQUE
        else register_change(name, expected[name], values[name], rad_per_position)
        for name in changed[:_SHOWN]
    ]
    return f"{'; '.join(texts)}: {_cause(facts, changed, expected, values)}"


def _cause(
    facts: ServoModel,
    changed: Sequence[str],
    expected: Mapping[str, int],
    values: Mapping[str, int],
) -> str:
    if MODE in changed:  # which resets gains
        return "another program has changed its mode"
    rows = facts.registers
    # a run has set these in RAM to other values than a restart
    lost_by_restart = {
        name
        for name, value in expected.items()
        if name not in _COPIES
        and rows[name].address > rows[TORQUE].address
        and value != rows[name].initial
    }
    is_proven = len(lost_by_restart) > 1 or TORQUE in changed
    if lost_by_restart and is_proven and lost_by_restart <= {*changed}:
        return "it has rebooted: check its supply and plugs"
    if changed != [TORQUE]:
        return "another program writes to it"
    other = "another program has switched it off"
    return other if lost_by_restart else f"it has rebooted, or {other}"
