"""A client that is killed or frozen while its servos move: what they do, read back over the line.

Servos with a bus watchdog stop. Others hold their last goal, and the start of a run names them.
"""

import json
import os
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import islice

import numpy as np
import pytest

from benchmarks.served_bus import wait_for
from snakewalk.config.loader import checked
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.config.servo_catalogue import servo_model, shipped_models
from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import DriverError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.port.network_port import open_port
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.serve.servo_bus import ServoBus
from snakewalk.sim.serve.virtual_time import VirtualTimeServer


def can_run(model: str) -> bool:
    """Whether a run drives servos of a model, and they can be simulated."""
    facts = servo_model(model)
    return facts.motor is not None and not facts.missing_for_a_run()


FIRST = ("STS3215", "XL330-M288", "XM430-W350", "SCS0009")
"""Models of the quick tests: with and without a watchdog."""
MODELS = [*FIRST, *(name for name in shipped_models() if name not in FIRST and can_run(name))]
FAMILIES = list({model[:2]: model for model in reversed(MODELS)}.values())
"""The first model of each series."""
PERIOD_S = 0.02
FAR_RAD = 0.6
"""Distance of the goal, so that a servo still moves when its client ends."""
CLIENT = """
import json, sys
from tests.sim.serve.test_killed_client import moving, robot_of
from snakewalk.drivers.port.network_port import open_port
port, model, patience_s = json.loads(sys.argv[1])
robot = robot_of(model)
for _ in moving(open_port(port, robot.servo.baud), robot, patience_s):
    print("moves", flush=True)
"""


def robot_of(model: str) -> RobotConfig:
    """Return two joints with servos of a model."""
    facts = servo_model(model)
    assert facts.motor is not None
    volts = facts.motor.nominal_v
    servo = {
        "model": model,
        "supply_v": volts,
        "baud": 1_000_000,
    }
    servo |= {"supply_min_v": 0.7 * volts, "supply_max_v": 1.3 * volts}
    return checked(RobotConfig, {"name": "two", "joint_axes": "yy", "servo": servo}, model)


def moving(port: BytePort, robot: RobotConfig, patience_s: float) -> Iterator[list[str]]:
    """Move both joints towards a far goal; yield the events of the start in each cycle.

    A device in real time needs patience: the server may be late.
    """
    safety = SafetyConfig(
        stale_limit_s=patience_s, following_time_s=60.0, goal_lead_rad=4.0, goal_rate_rad_s=0.3
    )
    events: list[str] = []
    latency_s = min(0.2 * patience_s, 0.2)
    bus = servo_bus(port, robot.models_by_id, latency_s=latency_s)
    chain = ServoChain(bus, robot, watchdog_s=max(0.2, 0.16 * patience_s))
    link = SafeLink(
        chain, SafetyLimits.from_config(robot, safety), port.clock, on_event=events.append
    )
    chain.on_event = events.append
    zero_rad = link.enable().position_rad
    next_s = port.clock.now_s()
    while True:
        port.clock.sleep_until_s(next_s)
        link.read()
        link.write(JointCommand(port.clock.now_s(), zero_rad + FAR_RAD))
        yield events
        next_s = max(next_s + PERIOD_S, port.clock.now_s())


def check(bus: ServoBus, facts: ServoModel, before: np.ndarray, after: np.ndarray) -> None:
    """Check the registers a second after the client, and the motion since then."""
    if "Bus Watchdog" in facts.registers:
        assert bus["Bus Watchdog"].tolist() == [255, 255]
    else:
        assert bus["Torque Enable"].tolist() == [1, 1]
    counts = 0.01 / facts.rad_per_position
    np.testing.assert_allclose(after, before, atol=counts)  # it does not move any more


@pytest.mark.slow_cases(10, "each shipped model")
@pytest.mark.fast_cases(4)
@pytest.mark.parametrize("model", MODELS)
def test_servos_whose_program_stands_still(model: str) -> None:
    """In simulated time; the program goes on after 2 s and is told."""
    facts = servo_model(model)
    bus = ServoBus(f"1-2:{model}")
    try:
        cycles = moving(bus.line, robot_of(model), 0.1)
        for _ in range(40):
            events = next(cycles)
        named = [event for event in events if "has no bus watchdog" in event]
        assert bool(named) == ("Bus Watchdog" not in facts.registers)
        last_goal = bus["Goal Position"].copy()
        bus.line.clock.advance(1.0)
        before = bus["Present Position"].copy()
        bus.line.clock.advance(1.0)
        after = bus["Present Position"].copy()
        check(bus, facts, before, after)
        if "Bus Watchdog" not in facts.registers:
            np.testing.assert_allclose(after, last_goal, atol=0.1 / facts.rad_per_position)
        with pytest.raises(DriverError, match=r"this program did not run|not read for"):
            deque(islice(cycles, 50), maxlen=0)
    finally:
        bus.close()


@contextmanager
def client(port: str, model: str, patience_s: float) -> Iterator[subprocess.Popen[str]]:
    """Another process that moves the servos."""
    words = json.dumps([port, model, patience_s])
    with subprocess.Popen(
        [sys.executable, "-c", CLIENT, words], text=True, stdout=subprocess.PIPE
    ) as process:
        try:
            assert process.stdout is not None
            for _ in range(20):
                assert process.stdout.readline() == "moves\n"
            yield process
        finally:
            with suppress(ProcessLookupError):
                process.kill()


@pytest.mark.slow_cases(2, "each shipped model")
@pytest.mark.fast_cases(0)
@pytest.mark.parametrize("model", MODELS)
def test_servos_whose_client_is_killed(model: str) -> None:
    """SIGKILL of another process; a second client waits, and reads the registers."""
    bus = ServoBus(f"1-2:{model}")
    ended = threading.Event()
    with VirtualTimeServer(bus.line, None) as server:
        thread = threading.Thread(target=server.serve, args=(ended.is_set,))
        thread.start()
        try:
            with client(server.path, model, 0.1) as process:
                os.kill(process.pid, signal.SIGKILL)
                process.wait()
            positions = []
            with open_port(server.path) as line:
                for _ in range(2):
                    line.clock.sleep_until_s(line.clock.now_s() + 1.0)
                    positions.append(bus["Present Position"].copy())
            check(bus, servo_model(model), *positions)
        finally:
            ended.set()
            thread.join()
            bus.close()


@pytest.mark.nightly("pseudo-terminal in real time")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
@pytest.mark.parametrize("model", FAMILIES)
def test_servos_on_a_device_whose_client_ends(model: str, number: int) -> None:
    bus = ServoBus(f"1-2:{model}")
    try:
        with client(bus.path, model, 5.0) as process:
            os.kill(process.pid, number)
            positions = []
            for _ in range(2):
                until_s = bus.line.clock.now_s() + 1.0
                wait_for(lambda until_s=until_s: bus.line.clock.now_s() > until_s)
                positions.append(bus["Present Position"].copy())
            check(bus, servo_model(model), *positions)
    finally:
        bus.close()
