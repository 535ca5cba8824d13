"""Fault files for every kind of fault and every pair of kinds, from fixed seeds."""

import random
from itertools import combinations
from typing import Any

from snakewalk.config.faults import FaultPlan
from tests.campaign.rig import ROBOT

NOISE = ("drop", "corrupt", "truncate", "duplicate", "delay", "late")
SERVO = ("mute", "stuck", "brown_out", "no_output", "alert")
TRIPS = ("reboot", "overload", "overheating", "voltage", "encoder", "shock")
WRITES = {
    "P gain": ("Position P Gain", (50, 400, 3000)),
    "I gain": ("Position I Gain", (30, 900)),
    "D gain": ("Position D Gain", (30, 3000)),
    "feed-forward": ("Feedforward 1st Gain", (50, 900)),
    "profile": ("Profile Velocity", (5, 60)),
    "goal PWM": ("Goal PWM", (0, 200)),
    "goal current": ("Goal Current", (0, 40)),
    "watchdog": ("Bus Watchdog", (0,)),
    "zero": ("Homing Offset", (100, 300)),
    "direction": ("Drive Mode", (1,)),
    "shutdown": ("Shutdown", (0,)),
    "limits": ("Min Position Limit", (100, 1000)),
    "hot limit": ("Temperature Limit", (90, 100)),
    "velocity limit": ("Velocity Limit", (100, 900)),
}
"""Registers that another program changes while the chain moves, and values that it may write."""
GOALS = ("second master", "deaf")
"""Kinds in which servos hold other goals than those that were sent."""
CHANGES = ("exchange", *GOALS, *WRITES)
OTHERS = ("remounted", "other robot", "cold sensor", "dip")
"""A servo without power gets another zero or direction; the port vanishes and another robot with
the same IDs comes back; a temperature reads 0; the supply is too low for less than 0.3 s."""
SENSORS = {
    "constant current": ("Present Current", (0, 20, -20, 186, -700)),
    "constant velocity": ("Present Velocity", (0, 100, -100)),
    "constant position": ("Present Position", (None,)),
    "constant heat": ("Present Temperature", (0, 60)),
}
"""Registers that show a constant value for seconds; None: the value at the beginning."""
JUMPS = {
    "jumping current": ("Present Current", (-900, 900)),
    "jumping velocity": ("Present Velocity", (-300, 300)),
    "jumping position": ("Present Position", (0, 4095)),
    "jumping heat": ("Present Temperature", (0, 79)),
}
"""Registers that show a wrong value for a moment, again and again, between these limits."""
LINES = ("lost writes", "slow adapter")
"""Requests that get lost at a rate that the run tolerates; replies that all come late, in time."""
BUS = ("heat", "supply", "unplug", "stall", "port")
OLDER = (*NOISE, *SERVO, "clash", *TRIPS, *BUS, *OTHERS, *CHANGES)
KINDS = (*OLDER, *SENSORS, *JUMPS, *LINES)
SCENARIOS = ((), *((kind,) for kind in KINDS), *combinations(KINDS, 2))
"""None, each alone, each pair."""
_EVERY_S = 2.5


def plan(kinds: tuple[str, ...], seed: int, duration_s: float) -> FaultPlan:
    """Faults of these kinds, each every few seconds, overlapping now and then."""
    rng = random.Random(f"{kinds} {seed}")
    faults = []
    for kind in kinds:
        at_s = rng.uniform(0.7, 1.4)  # the start takes half a second
        while at_s < duration_s:
            faults += [
                {"kind": kind, **each, "at_s": at_s + each.get("at_s", 0.0)}
                for each in _how(kind, rng)
            ]
            at_s += rng.uniform(0.6, 1.4) * _EVERY_S
    return FaultPlan.model_validate({"seed": seed, "fault": faults})


def _how(kind: str, rng: random.Random) -> list[dict[str, Any]]:
    ids = rng.sample(ROBOT.servo_ids, rng.randint(1, 2))
    for_s = rng.choice((0.01, 0.03, 0.1, 0.3, 0.8))
    if kind in (*OTHERS, *GOALS):
        return _several(kind, ids, rng)
    if kind in (*SENSORS, *JUMPS, *LINES):
        return _newer(kind, ids, rng)
    return [_one(kind, ids, for_s, rng)]


def _several(kind: str, ids: list[int], rng: random.Random) -> list[dict[str, Any]]:
    """Faults of the newer kinds, some of which consist of several."""
    for_s = rng.choice((0.3, 0.8, 1.5))
    match kind:
        case "second master":
            write = {"register": "Goal Position", "value": rng.choice((1500, 2048, 2500))}
            return [{"kind": "write", "ids": ids, **write, "every_s": 0.004, "for_s": for_s}]
        case "deaf":
            return [{"ids": ids, "for_s": for_s}]
        case "remounted":
            name, value = rng.choice((("Homing Offset", 300), ("Drive Mode", 1)))
            write = {"kind": "write", "ids": ids, "register": name, "value": value, "at_s": 0.1}
            return [{"kind": "brown_out", "ids": ids, "for_s": 0.3}, write]
        case "other robot":
            all_reboot = {"kind": "reboot", "ids": ROBOT.servo_ids, "at_s": 0.15}
            return [{"kind": "port", "for_s": 0.3}, all_reboot]
        case "cold sensor":
            register = {"register": "Present Temperature", "value": 0}
            return [{"kind": "reading", "ids": ids, **register, "for_s": for_s}]
        case _:
            return [{"kind": "supply", "volts": 9.7, "for_s": rng.choice((0.05, 0.15, 0.25))}]


def _newer(kind: str, ids: list[int], rng: random.Random) -> list[dict[str, Any]]:
    """Sensor faults of one servo, and faults of the line that the run tolerates."""
    reading = {"kind": "reading", "ids": ids[:1]}
    if kind in SENSORS:
        register, values = SENSORS[kind]
        return [{**reading, "register": register, "value": rng.choice(values), "for_s": 2.5}]
    if kind in JUMPS:
        register, (low, high) = JUMPS[kind]
        times = sorted(rng.uniform(0.0, 1.2) for _ in range(rng.randint(3, 12)))
        values = [rng.randint(low, high) for _ in times]
        return [
            {**reading, "register": register, "value": value, "at_s": at_s, "for_s": 0.02}
            for at_s, value in zip(times, values, strict=True)
        ]
    if kind == "lost writes":
        return [{"kind": "drop", "of": "questions", "chance": 0.1, "for_s": 1.0}]
    return [{"kind": "delay", "by_s": rng.choice((5e-4, 1e-3, 1.5e-3)), "for_s": 2.0}]


def _one(kind: str, ids: list[int], for_s: float, rng: random.Random) -> dict[str, Any]:
    if kind in NOISE:
        found: dict[str, Any] = {"for_s": for_s, "chance": rng.choice((0.05, 0.3, 1.0))}
        if kind in ("delay", "late"):
            found["by_s"] = rng.choice(
                (1e-3, 3e-3, 6e-3)
                if kind == "delay"
                else (0.01, 0.02, 0.035, 0.04, 0.05, 0.06, 0.08, 0.12)
            )
        elif rng.random() < 0.5:
            found["of"] = rng.choice(("questions", "both"))
        if "of" not in found and rng.random() < 0.3:
            found["ids"] = ids
        return found
    if kind in SERVO:
        return {"ids": ids, "for_s": for_s}
    if kind in WRITES:
        register, values = WRITES[kind]
        if register == "Goal Current":  # only pitch joints have it set
            ids = [ROBOT.servo_ids[j] for j, axis in enumerate(ROBOT.all_axes) if axis == "p"][:2]
        return {"kind": "write", "ids": ids, "register": register, "value": rng.choice(values)}
    if kind in ("clash", "exchange"):
        mine, other = rng.sample(ROBOT.servo_ids, 2)
        for_s = for_s if kind == "clash" else rng.choice((0.8, 1.5))
        return {"id": mine, "takes": other, "for_s": for_s}
    if kind in TRIPS:
        return {"ids": ids}
    if kind == "heat":
        return {"ids": ids, "celsius": rng.choice((50.0, 68.0, 75.0, 95.0))}
    if kind == "supply":
        return {"volts": rng.choice((0.0, 9.0, 10.5, 15.5)), "for_s": for_s}
    if kind == "unplug":
        return {"behind": rng.choice(ROBOT.servo_ids[:-1]), "for_s": for_s}
    return {"for_s": for_s}
