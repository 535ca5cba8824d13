"""Cause of changed registers: all of a servo's are read together before one is named."""

from collections.abc import Mapping, Sequence

from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.chain.fingerprint import register_change
from snakewalk.drivers.chain.start_up import IDENTITY
from snakewalk.drivers.protocol.registers import WATCHDOG, WATCHDOG_TRIPPED

TORQUE = "Torque Enable"
"""The first register in RAM: a restart sets it, and those behind it, to their initial values."""
MODE = "Operating Mode"
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
    reset = [name for name in changed if name != TORQUE and values[name] == rows[name].initial]
    # a run sets these to other values than a restart, if they are in RAM
    other_joints = [
        name
        for name in (IDENTITY, WATCHDOG)
        if name in expected and rows[name].address > rows[TORQUE].address
    ]
    if set(other_joints) <= set(reset) if other_joints else reset and TORQUE in changed:
        return "it has rebooted: check its supply and plugs"
    if len(changed) > 1 or TORQUE not in changed:
        return "another program writes to it"
    other = "another program has switched it off"
    return other if other_joints else f"it has rebooted, or {other}"
