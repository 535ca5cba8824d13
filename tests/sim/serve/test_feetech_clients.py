"""Unmodified clients for Feetech servos on the pseudo-terminal; each skips where not installed.

``ftservo-python-sdk`` and ``feetech-servo-sdk`` both install the module ``scservo_sdk``: each has a
folder of its own (`.ci/setup`) and runs in a process of its own.
"""

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from snakewalk.sim.serve.servo_bus import ServoBus
from tests.sim.serve.test_clients import settled

Make = Callable[..., ServoBus]
SCRIPTS = Path(__file__).parents[2] / "helpers"


def client(folder: str, script: str, *args: str) -> Any:
    """What a client prints that has only its own folder, and pyserial, on its path."""
    path = Path(sys.prefix) / folder
    if not (path / "scservo_sdk").is_dir():
        pytest.skip(f"{folder} is not installed")
    ran = subprocess.run(
        [sys.executable, str(SCRIPTS / script), *args],
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "PYTHONPATH": str(path)},
        check=False,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return json.loads(ran.stdout)


@pytest.mark.slow
def test_ftservo_python_sdk(servo_bus: Make) -> None:
    bus = servo_bus("1-3:STS3215")
    found = client("clients-ftservo", "ftservo_client.py", bus.path)
    assert found["model"] == [777]
    assert found["position"] == pytest.approx(2500, abs=8)
    position, speed = found["same"]  # Moving ends with the trajectory, and the shaft lags behind it
    assert position == pytest.approx(found["position"], abs=8)
    assert abs(speed) < 150, "a twentieth of the speed of the move"
    assert found["together"] == pytest.approx([2222, 1700, 2048], abs=8)
    assert (found["mode"], bus["Operating Mode"].tolist()) == ([1], [0, 0, 1])
    assert found["wheel"][0] == pytest.approx(-800, rel=0.1)
    assert bus["Lock"].tolist() == [1, 1, 1]


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("model", ["STS3215", "SCS0009", "HLS3606"])
def test_feetech_servo_sdk(servo_bus: Make, model: str) -> None:
    bus = servo_bus(f"1-2:{model}", start_rad=0.1)
    facts = bus.line.servos.facts  # type: ignore[union-attr]
    is_big = facts.byte_order == "big"
    found = client("clients-feetech", "feetech_sdk_client.py", bus.path, str(int(is_big)))
    assert found["model"] == [facts.model_number]
    assert (found["limit"], found["limit bytes"][2:]) == ([900], [3, 132] if is_big else [132, 3])
    assert bus["Max Position Limit"].tolist()[0] == 900
    assert found["goals"] == bus["Goal Position"].tolist() == [610, 420]
    assert found["torque"] == [1]
    if not is_big:
        assert found["middle"] == [2048]
        assert found["together"] == pytest.approx([2048 + 0.1 * 4096 / math.tau, 2048], abs=2)


def test_rustypot(servo_bus: Make) -> None:
    rustypot = pytest.importorskip("rustypot")
    bus = servo_bus("1-3:STS3215")
    robot = rustypot.Sts3215PyController(serial_port=bus.path, baudrate=1_000_000, timeout=60.0)
    ids, goals = [1, 2, 3], [0.3, -0.2, 0.1]
    assert robot.ping(3)
    assert robot.sync_read_model(ids) == [777] * 3
    robot.sync_write_torque_enable(ids, [True] * 3)
    robot.sync_write_goal_position(ids, goals)
    assert settled(
        bus,
        lambda: all(
            abs(seen - goal) < 0.02
            for seen, goal in zip(robot.sync_read_present_position(ids), goals, strict=True)
        ),
    )
    wanted = [2048 + goal * 4096 / math.tau for goal in goals]
    assert bus["Goal Position"].tolist() == pytest.approx(wanted, abs=1)
    assert robot.sync_read_present_voltage(ids) == [74] * 3
