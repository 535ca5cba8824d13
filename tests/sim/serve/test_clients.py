"""Unmodified clients of other people on the pseudo-terminal; each skips where it is not installed.

``pip install rustypot dynamixel-controller``, and LeRobot's motors alone need no more than
``pip install --no-deps lerobot deepdiff orderly-set cachebox tqdm``.
"""

import importlib
import importlib.util
import math
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from snakewalk.sim.serve.servo_bus import ServoBus

Make = Callable[..., ServoBus]


pytestmark = pytest.mark.usefixtures("patient_sdk")


def settled(bus: ServoBus, check: Callable[[], bool]) -> bool:
    """Ask until ``check``, for as long as a servo takes to move; the bus's own time counts."""
    until_s = bus.line.clock.now_s() + 3.0
    while bus.line.clock.now_s() < until_s:
        if check():
            return True
    return check()


def test_the_sdk_through_its_easy_interface(servo_bus: Make) -> None:
    easy = pytest.importorskip("dynamixel_easy_sdk")
    bus = servo_bus("1-3")
    connector = easy.Connector(bus.path, 1_000_000)
    motor = connector.createMotor(2)
    motor.disableTorque()
    motor.setOperatingMode(easy.OperatingMode.POSITION)
    motor.enableTorque()
    motor.setGoalPosition(2300)
    assert settled(bus, lambda: abs(motor.getPresentPosition() - 2300) < 10)
    motor.LEDOn()
    assert bus["LED"].tolist() == [0, 1, 0]
    motor.disableTorque()
    assert motor.isTorqueOn() == 0


def test_rustypot(servo_bus: Make) -> None:
    rustypot = pytest.importorskip("rustypot")
    bus = servo_bus("1-3:XL330-M288")
    robot = rustypot.Xl330PyController(serial_port=bus.path, baudrate=1_000_000, timeout=60.0)
    assert robot.ping(3)
    ids = [1, 2, 3]
    robot.sync_write_torque_enable(ids, [True] * 3)
    robot.sync_write_goal_position(ids, [0.3, -0.2, 0.1])
    assert settled(
        bus,
        lambda: all(
            abs(seen - goal) < 0.15
            for seen, goal in zip(
                robot.sync_read_present_position(ids), [0.3, -0.2, 0.1], strict=True
            )
        ),
    )
    wanted = [2048 + goal * 4096 / math.tau for goal in (0.3, -0.2, 0.1)]
    assert bus["Goal Position"].tolist() == pytest.approx(wanted, abs=1)


class _Unused(ModuleType):
    """Stands for a package that is imported and never used."""

    __path__: tuple[str, ...] = ()

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(name)
        return type(name, (), {})


@pytest.fixture
def lerobot_motors(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """LeRobot's motors; its package imports learning tools, which they never use."""
    for needed in ("lerobot", "deepdiff", "tqdm"):
        if importlib.util.find_spec(needed) is None:
            pytest.skip(f"{needed} is not installed")
    unused = ["torch", "accelerate", "datasets", "datasets.utils", "datasets.utils.logging"]
    here = {name for name in ("torch", "accelerate", "datasets") if importlib.util.find_spec(name)}
    for heavy in unused:
        if heavy.partition(".")[0] not in here:
            monkeypatch.setitem(sys.modules, heavy, _Unused(heavy))
    return importlib.import_module("lerobot.motors.dynamixel")


def test_lerobots_dynamixel_bus(servo_bus: Make, lerobot_motors: ModuleType) -> None:
    base = importlib.import_module("lerobot.motors")
    bus = servo_bus("1-3:XL330-M288")
    names = ["pan", "lift", "grip"]
    motors = {
        name: base.Motor(k, "xl330-m288", base.MotorNormMode.DEGREES)
        for k, name in enumerate(names, 1)
    }
    arm = lerobot_motors.DynamixelMotorsBus(port=bus.path, motors=motors)
    arm.connect()
    try:
        arm.configure_motors()
        arm.enable_torque()
        arm.sync_write("Goal_Position", dict.fromkeys(names, 2400), normalize=False)
        assert settled(
            bus,
            lambda: all(
                abs(seen - 2400) < 60
                for seen in arm.sync_read("Present_Position", normalize=False).values()
            ),
        )
        assert (bus["Return Delay Time"] == 0).all()
    finally:
        arm.disconnect()
    assert not bus["Torque Enable"].any()


def test_dynamixel_controller(servo_bus: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    # installed aside by the Makefile: its wheel would overwrite the SDK with an old one
    monkeypatch.setattr("sys.path", [*sys.path, str(Path(sys.prefix) / "clients")])
    pytest.importorskip("pkg_resources")
    pytest.importorskip("deprecation")
    dynio = pytest.importorskip("dynio.dynamixel_controller")
    bus = servo_bus("1-2")
    io = dynio.DynamixelIO(bus.path, 1_000_000)
    motor = io.new_mx28(2, protocol=2)  # the X series' addresses under their older name
    motor.torque_enable()
    motor.set_position(2200)
    assert settled(bus, lambda: abs(motor.get_position() - 2200) < 15)
    assert bus["Torque Enable"].tolist() == [0, 1]


def test_lerobots_bus_with_two_models(servo_bus: Make, lerobot_motors: ModuleType) -> None:
    """An arm of two XL430-W250 and four XL330-M288, as the Koch arm."""
    base = importlib.import_module("lerobot.motors")
    bus = servo_bus("1-2:XL430-W250,3-6:XL330-M288")
    motors = {
        f"m{k}": base.Motor(k, "xl430-w250" if k <= 2 else "xl330-m288", base.MotorNormMode.DEGREES)
        for k in range(1, 7)
    }
    arm = lerobot_motors.DynamixelMotorsBus(port=bus.path, motors=motors)
    arm.connect()  # compares the model numbers of all
    try:
        arm.enable_torque()
        arm.sync_write("Goal_Position", dict.fromkeys(motors, 2300), normalize=False)
        assert settled(
            bus,
            lambda: all(
                abs(seen - 2300) < 60
                for seen in arm.sync_read("Present_Position", normalize=False).values()
            ),
        )
    finally:
        arm.disconnect()
    assert not bus["Torque Enable"].any()


@pytest.mark.nightly("the bus of LeRobot at a served chain: 11 s of CPU")
def test_lerobots_feetech_bus(
    servo_bus: Make, lerobot_motors: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    del lerobot_motors  # its stand-ins for learning tools are needed
    folder = Path(sys.prefix) / "clients-feetech"
    if not folder.is_dir():
        pytest.skip("feetech-servo-sdk is not installed")
    monkeypatch.syspath_prepend(str(folder))
    port = importlib.import_module("scservo_sdk").PortHandler
    real_ms = port.getCurrentTime  # as ``patient_sdk`` does for the DYNAMIXEL SDK
    monkeypatch.setattr(port, "getCurrentTime", lambda own: real_ms(own) / 500.0)
    feetech = importlib.import_module("lerobot.motors.feetech")
    base = importlib.import_module("lerobot.motors")
    bus = servo_bus("1-6:STS3215")
    names = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"]
    motors = {
        name: base.Motor(k, "sts3215", base.MotorNormMode.DEGREES)
        for k, name in enumerate(names, 1)
    }
    arm = feetech.FeetechMotorsBus(port=bus.path, motors=motors)
    arm.connect()
    try:
        arm.configure_motors()
        offsets = arm.set_half_turn_homings()
        assert set(offsets) == set(names)
        arm.enable_torque()
        arm.sync_write("Goal_Position", dict.fromkeys(names, 2400), normalize=False)
        assert settled(
            bus,
            lambda: all(
                abs(seen - 2400) < 10
                for seen in arm.sync_read("Present_Position", normalize=False).values()
            ),
        )
        assert arm.read("Present_Voltage", "gripper", normalize=False) == 74
        assert (bus["Acceleration"] == 254).all()
    finally:
        arm.disconnect()
    assert not bus["Torque Enable"].any()
