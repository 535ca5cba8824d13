"""Causes that are planted against causes that a run names, and sound buses that must have no fault.

``python -m benchmarks.planted_causes`` writes the tables of ``docs/benchmarks/bus-faults.md``. The
kinds are those that users reported in public; each has its source.
"""

import random
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from benchmarks import odd_servos as odd
from benchmarks.provenance import provenance, write_tables
from tests.helpers.adapters import JOINTS, NETWORK_S, AdapterLine, swing

X, STS = "XM430-W350", "STS3215"
SDK = "ROBOTIS-GIT/DynamixelSDK#"
Faults = Sequence[dict[str, Any]]
ALL = list(range(1, JOINTS + 1))


@dataclass(frozen=True)
class Kind:
    """A cause, and the words that name it."""

    name: str
    source: str
    """Public report of such a case: ``owner/repository#number`` on GitHub."""
    names: str
    """Pattern of a message that names the cause, or this cause and one other."""
    faults: Callable[[int], Faults] = lambda servo: ()
    """Faults of a fault file for a servo ID."""
    change: Callable[[Any, int], None] | None = None
    """Change of the line for a servo ID, instead."""
    makes: tuple[str, ...] = (X, STS)
    least_rad: float = 0.1
    """Least amplitude of the swing; a fault that shows only in motion needs some."""


def _of(kind: str, **keys: Any) -> Callable[[int], Faults]:
    return lambda servo: [{"kind": kind, "ids": [servo], **keys}]


def _bus(kind: str, **keys: Any) -> Callable[[int], Faults]:
    return lambda servo: [{"kind": kind, **keys}]


def _write(register: str, value: int, **keys: Any) -> Callable[[int], Faults]:
    return _of("write", register=register, value=value, **keys)


def _mode(mode: int) -> Callable[[int], Faults]:
    """Torque is off for the change: the mode is locked while it is on."""
    writes = (("Torque Enable", 0, 0.0), ("Operating Mode", mode, 0.0), ("Torque Enable", 1, 1e-3))
    return lambda servo: [f for r, v, at_s in writes for f in _write(r, v, at_s=at_s)(servo)]


def _unplugged(servo: int) -> Faults:
    return [{"kind": "unplug", "behind": min(max(servo, 2), JOINTS - 2)}]


def _two_ids(kind: str) -> Callable[[int], Faults]:
    return lambda servo: [{"kind": kind, "id": servo, "takes": servo % JOINTS + 1}]


def _watchdog_stops(line: Any, servo: int) -> None:
    """Packets did not reach this servo for a while."""
    line.bank["Bus Watchdog"][servo - 1] = 255
    line.firmware.apply_registers()


def _latency(seconds: float, line: Any, servo: int) -> None:
    del servo
    line.usb_latency_s = seconds


def _goals(change: Callable[[Any], None], line: Any, servo: int) -> None:
    """Goals go wrong for all servos, or for servo 3."""
    del servo
    change(line)


SEEDS, SOUND_BUSES = range(24, 30), 500
"""Seeds 0 to 23 served the development of the rules."""
WRITES, OFF = "another program writes to it", "another program has switched it off"
KINDS = (
    Kind("rebooted", f"{SDK}283", "it has rebooted", _of("reboot")),
    Kind(
        "torque off", "dynamixel-community/dynamixel_hardware#54", OFF, _write("Torque Enable", 0)
    ),
    Kind("wheel mode", "liyiteng/AlohaMini#6", "changed its mode", _mode(1)),
    Kind("PWM mode", "Mickael-Roger/python-st3215#4", "changed its mode", _mode(16), makes=(X,)),
    Kind("step mode", "Mickael-Roger/python-st3215#4", "changed its mode", _mode(3), makes=(STS,)),
    Kind(
        "slow profile",
        "hello-robot/stretch_body#70",
        f"Profile Velocity is 5.*{WRITES}",
        _write("Profile Velocity", 5),
        makes=(X,),
    ),
    Kind(
        "slow start",
        f"{SDK}596",
        f"Profile Acceleration is 1.*{WRITES}",
        _write("Profile Acceleration", 1),
        makes=(X,),
    ),
    Kind(
        "slow speed",
        f"{SDK}296",
        f"Goal Velocity is 50.*{WRITES}",
        _write("Goal Velocity", 50),
        makes=(STS,),
    ),
    Kind(
        "slow acceleration",
        "bjoerngiesler/BBDroids#8",
        f"Acceleration is 1,.*{WRITES}",
        _write("Acceleration", 1),
        makes=(STS,),
    ),
    Kind(
        "torque limit",
        "jumejume1/AX-12A-servo-library#4",
        f"Goal PWM is 0.*{WRITES}",
        _write("Goal PWM", 0),
    ),
    Kind("low gain", f"{SDK}463", f"Position P Gain is 9.*{WRITES}", _write("Position P Gain", 9)),
    Kind("zero", f"{SDK}584", "its zero has moved", _write("Homing Offset", 100), makes=(X,)),
    Kind(
        "watchdog",
        "hello-robot/stretch_body#199",
        "bus watchdog has stopped it.*plugs",
        change=_watchdog_stops,
        makes=(X,),
    ),
    *(
        Kind(
            f"pause of {for_s:g} s",
            "hello-robot/stretch_body#278",
            "this program did not run",
            _bus("stall", for_s=for_s),
        )
        for for_s in (0.25, 3.0, 30.0)
    ),
    Kind("deaf to sync writes", "Xevel/usb2ax#1", "ignores sync writes", _of("deaf")),
    Kind(
        "lost writes",
        "Xevel/usb2ax#1",
        "loses what is written",
        change=partial(_goals, odd.lost_goals),
        makes=(X,),
    ),
    Kind(
        "late goals",
        "ROBOTIS-GIT/dynamixel-workbench#370",
        "accepts goals .*late",
        change=partial(_goals, odd.late_goals),
        makes=(X,),
        least_rad=0.2,
    ),
    Kind(
        "second master",
        "dynamixel-community/dynamixel_hardware#88",
        "second master",
        _write("Goal Position", 2200, every_s=0.005),
    ),
    Kind(
        "second master at rest",
        "dynamixel-community/dynamixel_hardware#88",
        "second master",
        lambda servo: [{**_write("Goal Position", 2048, every_s=0.005)(servo)[0], "ids": ALL}],
    ),
    Kind(
        "dead motor",
        "TheRobotStudio/SO-ARM100#66",
        "its motor does not push: dead output stage",
        _of("no_output"),
    ),
    Kind(
        "blocked",
        "ROBOTIS-GIT/dynamixel-workbench#382",
        "it is blocked",
        _of("stuck"),
        least_rad=0.3,
    ),
    Kind("overload", f"{SDK}345", "alarm: overload", _of("overload")),
    Kind("too hot", f"{SDK}539", "alarm: overheating|too hot", _of("overheating")),
    Kind(
        "input voltage",
        "pollen-robotics/reachy_mini#1402",
        "alarm: input voltage|supply too low",
        _of("voltage"),
    ),
    Kind(
        "lost connection",
        f"{SDK}345",
        "not read for .*its connection is lost",
        _of("mute"),
    ),
    Kind(
        "no power",
        "arebgun/dynamixel_motor#36",
        "no byte comes back: their supply",
        lambda servo: [{"kind": "brown_out", "ids": ALL}],
    ),
    Kind(
        "loose cable",
        "Interbotix/interbotix_ros_manipulators#240",
        "all behind .* are silent: the cable",
        _unplugged,
    ),
    Kind("same ID", f"{SDK}244", "are damaged: two servos with its ID", _two_ids("clash")),
    Kind("exchanged IDs", f"{SDK}11", "exchanged IDs", _two_ids("exchange")),
    Kind(
        "latency timer",
        f"{SDK}319",
        "ms late: high latency of the adapter",
        change=partial(_latency, 0.016),
    ),
    Kind(
        "adapter unplugged",
        "ROBOTIS-GIT/dynamixel-workbench#358",
        "the port has vanished",
        _bus("port"),
    ),
    Kind(
        "noise",
        f"{SDK}123",
        "bytes are damaged: noise|noise on the line",
        _bus("corrupt", chance=0.1),
    ),
    Kind("loose plug", f"{SDK}84", "a loose plug", _of("drop", chance=0.1)),
    Kind(
        "loose contact",
        "arebgun/dynamixel_motor#35",
        "it replies again: a loose contact",
        _of("mute", for_s=0.13),
    ),
    Kind(
        "no replies to reads",
        f"{SDK}459",
        "its Status Return Level",
        _write("Status Return Level", 0),
        makes=(X,),
    ),
    Kind(
        "dead current sensor",
        "ROBOTIS-GIT/dynamixel-workbench#334",
        "current reads .* constantly",
        _of("reading", register="Present Current", value=0),
        least_rad=0.3,
    ),
    Kind(
        "turn count",
        "huggingface/lerobot#3373",
        "a lost turn count",
        change=partial(_goals, odd.jumping_turn(1)),
        makes=(X,),
    ),
)


def named(kind: Kind, make: str, seed: int) -> str:
    """What a run says after a cause was planted; servo, motion and time are random."""
    rng = random.Random(f"{kind.name} {seed}")
    servo = rng.choice(ALL) if kind.least_rad < 0.3 else rng.choice(ALL[::2])
    change = kind.change
    return swing(
        make,
        amplitude_rad=rng.uniform(kind.least_rad, 0.5),
        speed_rad_s=rng.uniform(1.5, 3.5),
        phase_rad=rng.uniform(0.0, 6.0),
        at_s=rng.uniform(0.5, 1.5),
        faults=kind.faults(servo),
        change=None if change is None else lambda line: change(line, servo),
    ).said


def sound(seed: int) -> str:
    """What a run says on a sound bus: blocks or latency of 1 to 40 ms, and pauses.

    Each tenth bus is a network with 15 or 25 ms each way.
    """
    rng = random.Random(seed)
    speed_rad_s = rng.uniform(1.0, 5.0)
    late_s = rng.uniform(1e-3, 0.04)
    adapter = ("in_grid_s", "out_grid_s", "in_s", "out_s")[seed % 4]
    stalls = [
        {"kind": "stall", "at_s": rng.uniform(0.0, 2.0), "for_s": rng.uniform(0.005, 0.04)}
        for _ in range(3 * (seed % 2))
    ]
    delays = {adapter: late_s}
    if seed % 10 == 0:
        delays = dict.fromkeys(("in_s", "out_s"), (0.015, 0.025)[seed // 10 % 2])
    return swing(
        X,
        amplitude_rad=min(rng.uniform(0.1, 0.7), 2.4 / speed_rad_s),
        speed_rad_s=speed_rad_s,
        phase_rad=rng.uniform(0.0, 6.0),
        seconds=4.0,
        faults=stalls,
        at_s=0.5,
        load_n_m=rng.choice((0.0, 0.3, 0.6)),
        latency_s=NETWORK_S,
        line=AdapterLine(**delays),
    ).said


VERDICTS = ("alone", "one of two", "one of several", "missed")


def verdict(kind: Kind, said: str) -> str:
    """One of ``VERDICTS``: how a run names the planted cause, by the report that names it."""
    said = re.sub(r" \(torque off failed.*\)", "", said)
    found = re.search(kind.names, said)
    if found is None:
        return "missed"
    begin, end = said.rfind("; ", 0, found.start()) + 1, said.find("; ", found.end())
    causes = said[begin : None if end < 0 else end].rpartition(": ")[2]
    others = len(re.findall(r", or | or |, ", causes))
    return VERDICTS[min(others, 2)] if " or " in causes else "alone"


def planted_table() -> str:
    """Plant all causes; a row for each kind, then what the run said where it missed one."""
    rows, counts, misses = list[str](), Counter[str](), list[str]()
    for kind in KINDS:
        said = {(make, seed): named(kind, make, seed) for make in kind.makes for seed in SEEDS}
        found = {case: verdict(kind, text) for case, text in said.items()}
        own = Counter(found.values())
        counts += own
        misses += [
            f"- {kind.name}, {make}, seed {seed}: {said[make, seed].rpartition(': ')[2]}"
            for (make, seed), how in found.items()
            if how == "missed"
        ]
        repository, _, number = kind.source.partition("#")
        source = f"https://github.com/{repository}/issues/{number}"
        makes = "both" if len(kind.makes) > 1 else kind.makes[0]
        shown = " | ".join(str(own[how] or "") for how in VERDICTS)
        rows.append(f"| [{kind.name}]({source}) | {makes} | {shown} |")
    total = counts.total()
    lines = [
        f"{total} runs, seeds {SEEDS[0]} to {SEEDS[-1]}: "
        + ", ".join(f"{how} {counts[how]} ({counts[how] / total:.0%})" for how in [*counts])
        + ".",
        "",
        f"| cause | servos | {' | '.join(VERDICTS)} |",
        "| --- | --- | ---: | ---: | ---: | ---: |",
        *rows,
        *(["", "Missed:", "", *misses] if misses else []),
    ]
    return "\n".join(lines)


def sound_table() -> str:
    """Run all sound buses; their false alarms."""
    alarms = {seed: text for seed in range(SOUND_BUSES) if (text := sound(seed))}
    lines = [f"{SOUND_BUSES} buses, seeds 0 to {SOUND_BUSES - 1}: {len(alarms)} false alarms."]
    return "\n".join(
        [*lines, *([""] if alarms else []), *(f"- {s}: {t}" for s, t in alarms.items())]
    )


def main() -> None:
    """Write the tables."""
    head = provenance("python -m benchmarks.planted_causes")
    write_tables("bus-faults", "planted causes", f"{head}\n\n{planted_table()}")
    write_tables("bus-faults", "sound adapters", sound_table())


if __name__ == "__main__":
    main()
