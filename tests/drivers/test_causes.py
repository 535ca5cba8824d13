"""The cause that a run names is the one that was planted, and a sound bus has no fault.

The kinds are those that users reported in public; each has its source.
"""

import random
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import pytest

from benchmarks import odd_servos as odd
from tests.helpers.adapters import JOINTS, NETWORK_S, AdapterLine, Swing, swing

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
        "not read for .*no valid reply: its plug or supply",
        _of("mute"),
    ),
    Kind(
        "no power",
        "arebgun/dynamixel_motor#36",
        "no servo replies: their supply",
        lambda servo: [{"kind": "brown_out", "ids": ALL}],
    ),
    Kind(
        "loose cable",
        "Interbotix/interbotix_ros_manipulators#240",
        "all behind .* are silent: a cable or plug",
        _unplugged,
    ),
    Kind(
        "same ID", f"{SDK}244", "two servos with its ID|two servos with one ID", _two_ids("clash")
    ),
    Kind("exchanged IDs", f"{SDK}11", "exchanged IDs", _two_ids("exchange")),
    Kind(
        "latency timer",
        f"{SDK}319",
        "high latency|latency of adapter",
        change=partial(_latency, 0.016),
    ),
    Kind(
        "adapter unplugged",
        "ROBOTIS-GIT/dynamixel-workbench#358",
        "the port has vanished",
        _bus("port"),
    ),
    Kind("noise", f"{SDK}123", "noise|replies got lost", _bus("corrupt", chance=0.1)),
    Kind(
        "turn count",
        "huggingface/lerobot#3373",
        "a lost turn count",
        change=partial(_goals, odd.jumping_turn(1)),
        makes=(X,),
    ),
)
CASES = [
    pytest.param(kind, make, seed, id=f"{kind.name}-{make}-{seed}")
    for seed in range(6)
    for kind in KINDS
    for make in kind.makes
]


def _named(kind: Kind, make: str, seed: int) -> str:
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


@pytest.mark.slow_cases(30, "6 runs of each kind and make")
@pytest.mark.fast_cases(6)
@pytest.mark.parametrize(("kind", "make", "seed"), CASES)
def test_the_cause_that_was_planted_is_named(kind: Kind, make: str, seed: int) -> None:
    said = _named(kind, make, seed)
    assert re.search(kind.names, said), said


def _sound(seed: int) -> str:
    rng = random.Random(seed)
    speed_rad_s = rng.uniform(1.0, 5.0)
    late_s = rng.uniform(1e-3, 0.04)
    adapter = ("in_grid_s", "out_grid_s", "in_s", "out_s")[seed % 4]
    stalls = [
        {"kind": "stall", "at_s": rng.uniform(0.0, 2.0), "for_s": rng.uniform(0.005, 0.04)}
        for _ in range(3 * (seed % 2))
    ]
    run = partial(
        swing,
        X,
        amplitude_rad=min(rng.uniform(0.1, 0.7), 2.4 / speed_rad_s),
        speed_rad_s=speed_rad_s,
        phase_rad=rng.uniform(0.0, 6.0),
        seconds=4.0,
        faults=stalls,
        at_s=0.5,
        load_n_m=rng.choice((0.0, 0.3, 0.6)),
        latency_s=NETWORK_S,
    )
    ran = run(line=AdapterLine(**{adapter: late_s}))
    if not ran.at_start:
        return ran.said
    limit_s = float(ran.at_start[0].rpartition(" ")[2])
    return run(line=AdapterLine(**{adapter: late_s}), stale_limit_s=limit_s).said


@pytest.mark.slow_cases(20, "500 buses")
@pytest.mark.fast_cases(4)
@pytest.mark.parametrize("seed", range(500))
def test_a_sound_bus_has_no_fault(seed: int) -> None:
    """Blocks of 1 to 40 ms, latency up to 40 ms, and pauses of the computer.

    If the start names a larger ``safety.stale_limit_s``, the run has it.
    """
    assert not _sound(seed)


@pytest.mark.parametrize("phase_rad", [0.5, 2.75])
def test_goals_that_arrive_with_the_next_request_show_no_dead_motor(phase_rad: float) -> None:
    """Blocks of 40 ms: a joint had not moved yet when it was read, and was called dead."""
    assert not swing(
        X,
        line=AdapterLine(out_grid_s=0.04),
        amplitude_rad=0.5,
        phase_rad=phase_rad,
        seconds=6.0,
        latency_s=NETWORK_S,
    ).said


def test_a_dead_motor_is_named_behind_a_slow_adapter() -> None:
    said = swing(
        X,
        line=AdapterLine(out_grid_s=0.04),
        faults=[{"kind": "no_output", "ids": [3]}],
        latency_s=NETWORK_S,
    ).said
    assert "(ID 3)" in said
    assert "its motor does not push" in said


@pytest.mark.parametrize("make", [X, STS])
def test_a_pause_shorter_than_the_watchdog_is_read_again(make: str) -> None:
    """A pause of 0.15 s during a read ended the run: not read for 0.175 s."""
    assert not swing(make, faults=[{"kind": "stall", "for_s": 0.15}], seconds=3.0).said


def test_a_line_that_is_too_slow_for_the_limit_is_reported_at_the_start() -> None:
    line = AdapterLine(in_grid_s=0.036, out_grid_s=0.036)
    reports = swing(X, line=line, seconds=0.1, latency_s=NETWORK_S).at_start
    assert reports[0].startswith("replies need up to 0.")
    assert "safety.stale_limit_s is 0.1; set it to 0." in reports[0]


@pytest.mark.parametrize(("way_s", "limit_s"), [(0.015, 0.1), (0.025, 0.15), (0.04, 0.24)])
def test_a_network_works_with_the_limit_that_the_start_names(way_s: float, limit_s: float) -> None:
    """With 25 ms each way, each run at the default limit ended within a second."""

    def there_and_back(limit_s: float) -> Swing:
        line = AdapterLine(in_s=way_s, out_s=way_s)
        return swing(X, line=line, seconds=2.5, latency_s=NETWORK_S, stale_limit_s=limit_s)

    if limit_s > 0.1:
        at_default = there_and_back(0.1)
        assert f"set it to {limit_s:g}" in at_default.at_start[0]
        assert "its reply was slow: the latency of adapter or network" in at_default.said
    ran = there_and_back(limit_s)
    assert not ran.said + "".join(ran.at_start)
