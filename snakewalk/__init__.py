"""A hardware-in-the-loop controller for a robotic snake made of DYNAMIXEL servos.

The names of the library, described in ``docs/api.md``. Each one is imported at its first use, so
that ``import snakewalk`` takes no time and needs no extra.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from snakewalk.config.errors import InputError
    from snakewalk.config.faults import FaultPlan
    from snakewalk.config.loader import load_robot, load_run, load_world
    from snakewalk.config.robot.chain import RobotConfig
    from snakewalk.config.run import RunConfig, SafetyConfig
    from snakewalk.config.world import WorldConfig
    from snakewalk.controller.gaits.gait import Gait, Needs
    from snakewalk.controller.gaits.registry import GAITS, make_gait
    from snakewalk.controller.kinematics.links import BodyView, body_in_world
    from snakewalk.controller.metrics.summary import summary
    from snakewalk.controller.motion.gait_motion import GaitMotion
    from snakewalk.controller.motion.source import MotionSource, Pace
    from snakewalk.controller.run.external.real_time_robot import RealTimeRobot
    from snakewalk.controller.run.factory import prepare_policy, prepare_source, prepare_walk
    from snakewalk.controller.run.kinds.gait_factory import prepare_gait
    from snakewalk.controller.run.request import RunRequest, RunResult
    from snakewalk.controller.run.run_robot import run_robot
    from snakewalk.controller.runlog.reader import read_log
    from snakewalk.controller.runlog.record import RunRecord
    from snakewalk.controller.runtime.loop import ticks
    from snakewalk.controller.studies.sweep_measure import measure
    from snakewalk.controller.studies.sweep_points import plan_sweep
    from snakewalk.drivers.bus.budget import wire_budget
    from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
    from snakewalk.drivers.chain.servo_chain import ServoChain
    from snakewalk.drivers.clock import Clock
    from snakewalk.drivers.errors import DriverError, SafetyTrippedError
    from snakewalk.drivers.link import JointLink
    from snakewalk.drivers.port.byte_port import BytePort
    from snakewalk.drivers.port.serial_port import SerialPort
    from snakewalk.drivers.safety.limits import SafetyLimits
    from snakewalk.drivers.safety.safe_link import SafeLink
    from snakewalk.drivers.types import BodyPose, JointCommand, JointState
    from snakewalk.sim.serve.servo_bus import ServoBus

__all__ = [
    "GAITS",
    "BodyPose",
    "BodyView",
    "BytePort",
    "Clock",
    "DriverError",
    "DynamixelBus",
    "FaultPlan",
    "Gait",
    "GaitMotion",
    "InputError",
    "JointCommand",
    "JointLink",
    "JointState",
    "MotionSource",
    "Needs",
    "Pace",
    "RealTimeRobot",
    "RobotConfig",
    "RunConfig",
    "RunRecord",
    "RunRequest",
    "RunResult",
    "SafeLink",
    "SafetyConfig",
    "SafetyLimits",
    "SafetyTrippedError",
    "SerialPort",
    "ServoBus",
    "ServoChain",
    "WorldConfig",
    "body_in_world",
    "load_robot",
    "load_run",
    "load_world",
    "make_gait",
    "measure",
    "plan_sweep",
    "prepare_gait",
    "prepare_policy",
    "prepare_source",
    "prepare_walk",
    "read_log",
    "run_robot",
    "summary",
    "ticks",
    "wire_budget",
]

_NAMES = {
    "config.errors": ("InputError",),
    "config.faults": ("FaultPlan",),
    "config.loader": ("load_robot", "load_run", "load_world"),
    "config.robot.chain": ("RobotConfig",),
    "config.run": ("RunConfig", "SafetyConfig"),
    "config.world": ("WorldConfig",),
    "controller.run.request": ("RunRequest", "RunResult"),
    "controller.run.run_robot": ("run_robot",),
    "controller.run.external.real_time_robot": ("RealTimeRobot",),
    "controller.run.kinds.gait_factory": ("prepare_gait",),
    "controller.run.factory": (
        "prepare_policy",
        "prepare_source",
        "prepare_walk",
    ),
    "controller.studies.sweep_measure": ("measure",),
    "controller.studies.sweep_points": ("plan_sweep",),
    "controller.gaits.gait": ("Gait", "Needs"),
    "controller.gaits.registry": ("GAITS", "make_gait"),
    "controller.kinematics.links": ("BodyView", "body_in_world"),
    "controller.metrics.summary": ("summary",),
    "controller.motion.gait_motion": ("GaitMotion",),
    "controller.motion.source": ("MotionSource", "Pace"),
    "controller.runlog.reader": ("read_log",),
    "controller.runlog.record": ("RunRecord",),
    "controller.runtime.loop": ("ticks",),
    "drivers.bus.budget": ("wire_budget",),
    "drivers.bus.dynamixel_bus": ("DynamixelBus",),
    "drivers.chain.servo_chain": ("ServoChain",),
    "drivers.clock": ("Clock",),
    "drivers.errors": ("DriverError", "SafetyTrippedError"),
    "drivers.link": ("JointLink",),
    "drivers.port.byte_port": ("BytePort",),
    "drivers.port.serial_port": ("SerialPort",),
    "drivers.safety.safe_link": ("SafeLink",),
    "drivers.safety.limits": ("SafetyLimits",),
    "drivers.types": ("BodyPose", "JointCommand", "JointState"),
    "sim.serve.servo_bus": ("ServoBus",),
}
_MODULES = {name: f"snakewalk.{module}" for module, names in _NAMES.items() for name in names}
"""The module of each public name."""


def __getattr__(name: str) -> object:
    """Import a public name at its first use (PEP 562)."""
    if name not in _MODULES:
        raise AttributeError(f"module 'snakewalk' has no attribute {name!r}")
    value = getattr(import_module(_MODULES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Public names, imported or not."""
    return sorted({*globals(), *__all__})
