"""Scenarios of ``benchmarks.bus_faults``: every kind of fault file, and combinations of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from snakewalk.drivers.safety.recovery import Policy
from snakewalk.sim.line.sim_line import SimLine

AT_S = 1.0
"""When the fault begins, after the start."""
ALL = tuple(range(1, 7))


@dataclass(frozen=True)
class Scenario:
    """One fault, or several that belong together."""

    name: str
    faults: Sequence[dict[str, Any]]
    cycles: int = 300
    amplitude_rad: float = 0.3
    policy: Policy = "stop"
    load_n_m: float = 0.0
    is_harmless: bool = False
    """A run should go on without a word."""
    between_runs: Callable[[SimLine], None] | None = None
    """Changes the servos between two runs that share a fingerprint file."""


def _one(name: str, kind: str, **keys: Any) -> Scenario:
    return Scenario(name, [{"kind": kind, **keys}])


def _write(register: str, value: int, ids: Sequence[int] = (3,), **keys: Any) -> dict[str, Any]:
    return {"kind": "write", "register": register, "value": value, "ids": ids, **keys}


def _written(register: str, value: int, ids: Sequence[int] = (3,)) -> Scenario:
    return Scenario(f"`write`: {register} = {value}", [_write(register, value, ids)])


def _set(name: str, value: int) -> Callable[[SimLine], None]:
    def change(line: SimLine) -> None:
        line.bank[name][2] = value

    return change


def _off(name: str, register: str, value: int) -> Scenario:
    """A servo that another program changes while it has no power; the policy is to go on."""
    change = _write(register, value, at_s=0.1)
    return Scenario(
        f"{name}, changed during a power cut; policy resume",
        [{"kind": "brown_out", "ids": [3], "for_s": 0.3}, change],
        policy="resume",
    )


_NOISE = [
    _one(f"`{kind}`, {chance:.0%} of all {of}", kind, chance=chance, of=of)
    for kind in ("drop", "corrupt", "truncate", "duplicate")
    for chance, of in ((0.02, "answers"), (0.05, "questions"), (1.0, "both"))
]
_SLOW = [
    _one(f"`{kind}`, 5% of all answers by {1e3 * by_s:.0f} ms", kind, chance=0.05, by_s=by_s)
    for kind, by_s in (("delay", 1e-3), ("delay", 6e-3), ("late", 0.01), ("late", 0.05))
]
_SERVOS = [
    _one("`mute`", "mute", ids=[3]),
    _one("`mute` for 0.05 s", "mute", ids=[3], for_s=0.05),
    _one("`stuck`", "stuck", ids=[3]),
    _one("`brown_out`, one servo", "brown_out", ids=[3]),
    _one("`brown_out` for 0.06 s, one servo", "brown_out", ids=[3], for_s=0.06),
    _one("`no_output`", "no_output", ids=[3]),
    Scenario(
        "`no_output`, small amplitude (0.18 rad)",
        [{"kind": "no_output", "ids": [3]}],
        amplitude_rad=0.18,
    ),
    _one("`deaf` to sync writes", "deaf", ids=[3]),
    _one("`alert` without an error", "alert", ids=[3]),
    _one("`clash`: two servos with one ID", "clash", id=2, takes=3),
    _one("`exchange`: IDs of two servos", "exchange", id=2, takes=4),
    *(_one(f"`{each}`", each, ids=[3]) for each in ("reboot", "overload", "overheating")),
    *(_one(f"`{each}`", each, ids=[3]) for each in ("voltage", "encoder", "shock")),
    _one("`reboot` of all servos", "reboot", ids=ALL),
]
_BUS = [
    _one("`heat` to 75 C", "heat", ids=[3], celsius=75.0),
    _one("`supply` at 9.7 V", "supply", volts=9.7),
    Scenario(
        "`supply` at 9.7 V for 0.2 s",
        [{"kind": "supply", "volts": 9.7, "for_s": 0.2}],
        is_harmless=True,
    ),
    _one("`supply` at 15.5 V", "supply", volts=15.5),
    _one("`supply` at 0 V", "supply", volts=0.0),
    _one("`supply` at 6 V, one servo", "supply", volts=6.0, ids=[3]),
    _one("`unplug` behind servo 3", "unplug", behind=3),
    Scenario("`stall` of 0.05 s", [{"kind": "stall", "for_s": 0.05}], is_harmless=True),
    _one("`stall` of 0.3 s", "stall", for_s=0.3),
    _one("`port` for 0.3 s", "port", for_s=0.3),
    Scenario("`port` for 0.3 s; policy resume", [{"kind": "port", "for_s": 0.3}], policy="resume"),
]
_WRITES = [
    *(_written("Position P Gain", each) for each in (50, 3000)),
    _written("Position I Gain", 900),
    _written("Position D Gain", 3000),
    _written("Feedforward 1st Gain", 900),
    _written("Profile Velocity", 5),
    _written("Goal PWM", 0),
    _written("Goal PWM", 200),
    _written("Goal Current", 5, (2,)),
    _written("Bus Watchdog", 0),
    _written("Torque Enable", 0),
    _written("Homing Offset", 100),
    _written("Homing Offset", 300),
    _written("Drive Mode", 1),
    _written("Shutdown", 0),
    _written("Min Position Limit", 2000),
    _written("PWM Limit", 100),
    _written("Current Limit", 20),
    Scenario("`write`: Goal Position once", [_write("Goal Position", 2200)], is_harmless=True),
    Scenario(
        "second master: Goal Position of one joint, every 5 ms",
        [_write("Goal Position", 2200, every_s=0.005)],
    ),
    Scenario(
        "second master: Goal Position of all joints, every 5 ms",
        [_write("Goal Position", 2048, ALL, every_s=0.005)],
    ),
    Scenario(
        "second master: Goal Position of all joints, small amplitude (0.05 rad)",
        [_write("Goal Position", 2048, ALL, every_s=0.005)],
        amplitude_rad=0.05,
    ),
]
_SENSORS = [
    _one("`reading`: temperature 0", "reading", ids=[3], register="Present Temperature", value=0),
    Scenario(
        "`reading`: temperature constant while the chain warms up",
        [{"kind": "reading", "ids": [3], "register": "Present Temperature"}],
        cycles=6000,
        amplitude_rad=0.1,
        load_n_m=1.6,
    ),
    _one("`reading`: position constant", "reading", ids=[3], register="Present Position"),
    _one(
        "`reading`: position half a turn off",
        "reading",
        ids=[3],
        register="Present Position",
        value=4095,
    ),
    _one("`reading`: voltage 0", "reading", ids=[3], register="Present Input Voltage", value=0),
]
_ANOTHER = [
    _off("zero", "Homing Offset", 100),
    _off("direction", "Drive Mode", 1),
    Scenario(
        "another robot with the same IDs behind a port that vanished; policy resume",
        [{"kind": "port", "for_s": 0.4}, {"kind": "reboot", "ids": ALL, "at_s": 0.2}],
        policy="resume",
    ),
    Scenario("zero changed between two runs", (), between_runs=_set("Homing Offset", 100)),
    Scenario("direction changed between two runs", (), between_runs=_set("Drive Mode", 1)),
    Scenario("Shutdown = 0 between two runs", (), between_runs=_set("Shutdown", 0)),
]
SCENARIOS = (*_NOISE, *_SLOW, *_SERVOS, *_BUS, *_WRITES, *_SENSORS, *_ANOTHER)
