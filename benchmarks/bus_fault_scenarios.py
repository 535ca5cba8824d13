"""Scenarios of ``benchmarks.bus_faults``: every kind of fault file, and combinations of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from benchmarks import odd_servos as odd
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
    on_line: Callable[[SimLine], None] | None = None
    """Begins a fault of servos or adapter that no fault file has."""


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


_TEMPERATURE = "Present Temperature"


def _reading(register: str, value: int | None = None) -> dict[str, Any]:
    return {"kind": "reading", "ids": [3], "register": register, "value": value}


def _again(kind: str, every_s: float, for_s: float, **keys: Any) -> list[dict[str, Any]]:
    """A fault that comes back for 6 s."""
    times = range(round(6.0 / every_s))
    return [{"kind": kind, "at_s": every_s * k, "for_s": for_s, **keys} for k in times]


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
    _written("Velocity Limit", 900),
    _written("Temperature Limit", 100),
    _written("Min Voltage Limit", 100),
    _written("Max Voltage Limit", 150),
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
    *(
        Scenario(
            f"second master: Goal Position of all joints, every {every_s:g} s",
            [_write("Goal Position", 2048, ALL, every_s=every_s)],
            cycles=2000,
        )
        for every_s in (0.03, 0.1, 0.51)
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
_CONSTANT = (
    ("current", 0),
    ("current", 186),
    ("current", -700),
    ("velocity", 0),
    ("velocity", 100),
)
FURTHER = [
    *(
        Scenario(
            f"`reading`: {name} always {value}",
            [_reading(f"Present {name.title()}", value)],
            load_n_m=0.6,
        )
        for name, value in _CONSTANT
    ),
    Scenario(
        "`reading`: velocity always 100, and `no_output`, small amplitude (0.18 rad)",
        [_reading("Present Velocity", 100), {"kind": "no_output", "ids": [3]}],
        amplitude_rad=0.18,
    ),
    *(
        Scenario(
            f"`reading`: current always {value}, and `no_output`, amplitude {amplitude} rad",
            [_reading("Present Current", value), {"kind": "no_output", "ids": [3]}],
            amplitude_rad=amplitude,
        )
        for value, amplitude in ((186, 0.18), (-186, 0.18), (40, 0.12), (-700, 0.18), (186, 0.1))
    ),
    Scenario(
        "`reading`: current always 186, pitch joint, and `no_output`, amplitude 0.18 rad",
        [
            {**_reading("Present Current", 186), "ids": [4]},
            {"kind": "no_output", "ids": [4]},
        ],
        amplitude_rad=0.18,
    ),
    Scenario(
        "`reading`: current, velocity and position constant",
        [_reading(f"Present {name}") for name in ("Current", "Velocity", "Position")],
    ),
    _one("`reading`: temperature 60 C", "reading", ids=[3], register=_TEMPERATURE, value=60),
    _one("`reading`: temperature 255 C", "reading", ids=[3], register=_TEMPERATURE, value=255),
    Scenario("`alert` that comes and goes", _again("alert", 0.1, 0.03, ids=[3])),
    Scenario("`supply` at 9.7 V for 0.15 s, every 0.4 s", _again("supply", 0.4, 0.15, volts=9.7)),
    Scenario("`stall` of 0.06 s, every 0.2 s", _again("stall", 0.2, 0.06)),
    _one("`stall` of 10 s", "stall", for_s=10.0),
    Scenario(
        "torque off for 10 ms, by another program, once",
        [_write("Torque Enable", 0), _write("Torque Enable", 1, at_s=0.01)],
        is_harmless=True,
    ),
    Scenario(
        "torque off for 10 ms, by another program, every 50 ms",
        [
            _write("Torque Enable", on, ALL, at_s=0.05 * k + 0.01 * on)
            for k in range(100)
            for on in (0, 1)
        ],
    ),
    Scenario(
        "`reboot`, and torque on by another program after 3 ms",
        [{"kind": "reboot", "ids": [3]}, _write("Torque Enable", 1, at_s=0.003)],
    ),
    Scenario(
        "Goal PWM 0 for 30 ms, by another program, every 40 ms",
        [
            _write("Goal PWM", value, at_s=0.04 * k + late_s)
            for k in range(100)
            for value, late_s in ((0, 0.0), (885, 0.03))
        ],
    ),
    _written("Operating Mode", 4),
    _written("Status Return Level", 0),
    _written("Return Delay Time", 250, ALL),
    _written("Baud Rate", 1),
    _written("Max Position Limit", 1700),
    _one("`exchange` for 0.03 s", "exchange", id=2, takes=4, for_s=0.03),
    *(
        Scenario(
            f"{name} changed behind a port that vanished; policy resume",
            [{"kind": "port", "for_s": 0.3}, _write(name, value, at_s=0.1)],
            policy="resume",
        )
        for name, value in (
            ("Max Position Limit", 2100),
            ("Model Number", 1060),
            ("Firmware Version", 12),
        )
    ),
]


def _odd(name: str, action: odd.Action, **keys: Any) -> Scenario:
    return Scenario(name, (), on_line=action, **keys)


BY_HAND = [
    _odd("goals accepted two cycles late", odd.late_goals),
    _odd("goals with reversed bytes", odd.swapped_goals),
    _odd("goals that reach no servo", odd.lost_goals),
    _odd("echo of 5% of all requests", odd.echo(0.05)),
    _odd("echo of all requests", odd.echo(1.0)),
    _odd("3% of all replies with two bytes exchanged", odd.reordered_bytes),
    _odd("plain replies in the wrong order", odd.reordered_packets),
    _odd("baud rate that drifts: up to 60% of all replies damaged", odd.drifting_baud),
    _odd("adapter latency that grows from 1 to 16 ms", odd.growing_latency),
    _odd("data of another servo", odd.foreign_data),
    _odd("data of another address", odd.other_block),
    _odd("position off by a turn", odd.jumping_turn(1)),
    _odd("position off by a turn in one of seven reads", odd.jumping_turn(7)),
    _odd("position constant while the joint moves", odd.frozen_in_motion),
    _odd("current with the wrong sign", odd.wrong_sign_of_current, load_n_m=0.6),
    _odd("encoder that slips by 0.15 rad", odd.slipped_zero(0.15)),
    _odd(
        "encoder that slips by 0.1 rad per minute",
        odd.slipped_zero(0.1, 65, 60.0),
        cycles=3000,
    ),
    _odd("gears that transmit 30% of the torque", odd.weak_motor(0.3), load_n_m=0.6),
    _odd("broken gears", odd.weak_motor(1e-6)),
]
"""Faults that no fault file has: ``odd_servos`` plays them."""
SCENARIOS = (
    *(*_NOISE, *_SLOW, *_SERVOS, *_BUS, *_WRITES, *_SENSORS, *_ANOTHER),
    *(*FURTHER, *BY_HAND),
)
