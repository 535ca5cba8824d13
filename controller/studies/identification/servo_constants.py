"""Results of the identification of a servo, with name, BAM name, range and unit; BAM's JSON.

BAM ("Better Actuator Models", Rhoban) writes the constants of a servo with a friction of this form.
The greatest friction torque is ``dry + |by_load t_load - by_motor t_motor|``. While the shaft is
slow it is ``stribeck + |by_load_slow t_load - by_motor_slow t_motor|`` more, times
``exp(-(|w| / stribeck_rad_s)^exponent)``. The term ``viscous w`` is added. Where motor and load
strive against each other, the slow share has a square as well: ``by_load_square t_load^2`` while
the motor is the stronger, ``by_motor_square t_motor^2`` while the load is. (Duclusaud et al.,
"Extended Friction Models for the Physics Simulation of Servo Actuators", ICRA 2025: models M1 to
M6.)
"""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from snakewalk.config.archive import read_json_object
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import with_keys
from snakewalk.config.motor import MotorConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_catalogue import servo_model, shipped_models
from snakewalk.sim.servo.motor import MOTORS, MotorModel


class Constant(NamedTuple):
    """One constant of a servo."""

    name: str
    """Name of the constant, with its unit."""
    bam: str
    """Name of the constant in BAM's files."""
    low: float
    high: float
    """Searched range of an XL330 (ours); ``ranges`` has those of other servos."""
    start: float
    absent: float
    """Value for a file of BAM that lacks it."""


_XL330 = MOTORS["XL330-M288"]
_XL330_P_UNIT = _XL330.positions_per_rad / _XL330.p_gain_divisor / _XL330.full_pwm
CONSTANTS = (
    Constant("torque_constant_n_m_a", "kt", 0.05, 5.0, 0.4, math.nan),
    Constant("resistance_ohm", "R", 0.3, 20.0, 4.0, math.nan),
    Constant("armature_kg_m2", "armature", 1e-5, 0.1, 2e-3, math.nan),
    Constant("offset_rad", "q_offset", -0.13, 0.13, 0.0, 0.0),
    Constant("dry_n_m", "friction_base", 0.0, 0.3, 0.01, math.nan),
    Constant("stribeck_n_m", "friction_stribeck", 0.0, 0.3, 0.005, 0.0),
    Constant("by_motor", "load_friction_motor", 0.0, 0.6, 0.2, 0.0),
    Constant("by_load", "load_friction_external", 0.0, 0.6, 0.2, 0.0),
    Constant("by_motor_slow", "load_friction_motor_stribeck", 0.0, 0.6, 0.05, 0.0),
    Constant("by_load_slow", "load_friction_external_stribeck", 0.0, 0.6, 0.05, 0.0),
    Constant("stribeck_rad_s", "dtheta_stribeck", 0.05, 2.0, 0.3, 0.3),
    Constant("stribeck_exponent", "alpha", 0.8, 6.0, 2.0, 2.0),
    Constant("viscous_n_m_s", "friction_viscous", 0.0, 0.5, 0.02, math.nan),
    Constant("p_unit_per_rad", "error_gain", 5e-4, 2e-2, 3e-3, _XL330_P_UNIT),
    Constant("delay_s", "command_delay", 0.0, 0.04, 0.004, 0.0),
    Constant("backlash_rad", "backlash", 0.0, 0.1, 0.0, 0.0),
    Constant("by_motor_square", "load_friction_motor_quad", 0.0, 1.0, 0.0, 0.0),
    Constant("by_load_square", "load_friction_external_quad", 0.0, 1.0, 0.0, 0.0),
)
"""``p_unit_per_rad`` is the share of the supply that a radian of error gets for each unit of the P
gain. ``offset_rad`` and ``delay_s`` are the bench's: the offset of its zero, and the delay until a
goal has an effect. The offset is at most half a tooth of a horn with 25."""
NAMES = tuple(constant.name for constant in CONSTANTS)
_SQUARES = ("by_motor_square", "by_load_square")
FITTED = NAMES.index("backlash_rad")
"""Number of constants that every fit estimates, the first. The next one, the backlash, is estimated
on request; squares stay as given (``docs/identify.md`` states the reason)."""
_OHM_FACTOR = 6.0
"""Greatest factor of a resistance on nominal voltage over stall current (ours): recordings give
that of a weaker motor with a smaller torque constant, too."""
_END_OF_RANGE = 1e-3
"""Share of a range within which a constant stands on its end (ours)."""
_FORMS = ("m1", "m2", "m3", "m4", "m5", "m6")
_BOTH_SIDES = {
    "load_friction_base": ("load_friction_motor", "load_friction_external"),
    "load_friction_stribeck": (
        "load_friction_motor_stribeck",
        "load_friction_external_stribeck",
    ),
}
"""Models M3 and M4 of BAM, which do not depend on the side of a torque."""


@dataclass(frozen=True, slots=True)
class ServoConstants:
    """Values of ``CONSTANTS``, and how far they may be off."""

    values: Floats
    """(18,) in the order of ``CONSTANTS``."""
    low: Floats
    high: Floats
    """(18,) ends of the 95 % intervals; NaN if they are unknown."""
    actuator: str
    """BAM's name of the servo: ``xl330``, ``mx64``, ..."""

    def __getitem__(self, name: str) -> float:
        """Value of a constant."""
        return float(self.values[NAMES.index(name)])


class Ranges(NamedTuple):
    """Where the constants (18,) of a servo are searched, and where a search begins."""

    low: Floats
    high: Floats
    start: Floats

    def bounds_reached(self, values: Floats) -> dict[str, tuple[float, str]]:
        """Return the constants that stand on an end of their range: the end, and its name.

        A zero of friction, delay or backlash is a value, not an end of a search.
        """
        reached = {}
        for name, value, low, high in zip(NAMES, values, self.low, self.high, strict=True):
            near = _END_OF_RANGE * (high - low)
            if value >= high - near:
                reached[name] = float(high), "upper"
            elif low != 0.0 and value <= low + near:
                reached[name] = float(low), "lower"
        return reached


def is_of(model: str, actuator: str) -> bool:
    """Whether a servo model may be the one that a recording names; no name fits every model."""
    return model.lower().replace("-", "").startswith(actuator.lower().replace("-", ""))


def _motors(actuator: str) -> list[MotorModel]:
    models = [servo_model(name) for name in shipped_models() if is_of(name, actuator)]
    models_with_motor = [
        model for model in models if model.motor is not None and model.units.full_pwm
    ]
    return [MotorModel.of(model) for model in models_with_motor]


@cache
def ranges(actuator: str) -> Ranges:
    """Return the searched ranges of the servo that a recording names.

    P unit and resistance follow the data of the shipped models with this name; if none has it, of
    those with the same letters in front (STS, XL), else of all. The ranges of the other constants
    hold for every small servo.
    """
    motors = _motors(actuator) or _motors(re.split(r"[^a-z]", actuator.lower())[0])
    motors = motors or _motors("")
    units = [m.positions_per_rad / m.p_gain_divisor / m.full_pwm / _XL330_P_UNIT for m in motors]
    ohms = [m.resistance_ohm for m in motors]
    low, high, start = (
        np.array([getattr(constant, key) for constant in CONSTANTS])
        for key in ("low", "high", "start")
    )
    unit = NAMES.index("p_unit_per_rad")
    ohm = NAMES.index("resistance_ohm")
    low[unit] *= min(units)
    high[unit] *= max(units)
    start[unit] *= math.sqrt(min(units) * max(units))
    low[ohm] = min(low[ohm], min(ohms) / _OHM_FACTOR)
    high[ohm] = max(high[ohm], max(ohms) * _OHM_FACTOR)
    return Ranges(low, high, start)


def bam_text(constants: ServoConstants) -> str:
    """JSON as BAM writes it: M5, or M6 with squares, and the intervals."""
    data: dict[str, object] = {
        c.bam: float(v) for c, v in zip(CONSTANTS, constants.values, strict=True)
    }
    if not any(constants[name] for name in _SQUARES):
        data = {c.bam: data[c.bam] for c in CONSTANTS if c.name not in _SQUARES}
        data |= {"model": "m5", "actuator": constants.actuator}
    else:
        data |= {"model": "m6", "actuator": constants.actuator}
    if not constants["backlash_rad"]:
        del data["backlash"]
    intervals = {
        c.bam: [float(low), float(high)]
        for c, low, high in zip(CONSTANTS, constants.low, constants.high, strict=True)
        if math.isfinite(low)
    }
    if intervals:
        data["interval_95"] = intervals
    return json.dumps(data, indent=2) + "\n"


def read_bam(path: Path) -> ServoConstants:
    """Read a file of BAM's constants, models M1 to M6.

    BAM knows the unit of the P gain by the servo's name: of a file without ``error_gain`` it is
    that of the XL330.

    Raises:
        InputError: it is not such a file, or needs a term that is not modelled here.

    """
    data = read_json_object(path)
    if data.get("model") not in _FORMS:
        raise InputError(
            f"{path}: model is {data.get('model')!r}; expected one of {', '.join(_FORMS)}"
        )
    for shared, sides in _BOTH_SIDES.items():
        if shared in data:
            data = dict.fromkeys(sides, data[shared]) | data
    values = np.empty(len(CONSTANTS))
    faults = []
    for k, constant in enumerate(CONSTANTS):
        value = data.get(constant.bam, constant.absent)
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not math.isfinite(value)
        ):
            faults.append(f"{path}: {constant.bam}: expected a number, found {value}")
        else:
            values[k] = value
    if faults:
        raise InputError(faults)
    unknown = np.full(len(CONSTANTS), np.nan)
    return ServoConstants(values, unknown, unknown, str(data.get("actuator", "")))


def check_servo(robot: RobotConfig, actuator: str) -> None:
    """Refuse constants of a servo that is not the robot's; one without a name is taken for it.

    Raises:
        InputError: it is another one.

    """
    model = robot.servo.model
    if not is_of(model, actuator):
        raise InputError(
            f"the constants are of a servo {actuator}, robot {robot.name} has {model}; give "
            "recordings of its own (their motor is the model's name, or its beginning)"
        )


def robot_with(robot: RobotConfig, constants: ServoConstants) -> RobotConfig:
    """Return the robot with these constants, for every joint with a servo of ``servo.model``.

    Raises:
        InputError: the constants are of another servo.

    """
    check_servo(robot, constants.actuator)
    rounded = {name: float(f"{constants[name]:.5g}") for name in NAMES}
    motor_constants = {name: rounded[name] for name in MotorConfig.model_fields if name in rounded}
    changes: dict[str, object] = {
        "servo.motor": motor_constants,
        "servo.armature_kg_m2": rounded["armature_kg_m2"],
        "servo.gear_drag_n_m_s": rounded["viscous_n_m_s"],
    }
    main_model = robot.servo.model
    if set(robot.servo_models) != {main_model}:  # joints with another servo keep what they had
        kept = zip(robot.armatures_kg_m2, robot.gear_drags_n_m_s, strict=True)
        changes["joints"] = [
            joint.model_dump(exclude_defaults=True)
            | ({} if model == main_model else {"armature_kg_m2": armature, "gear_drag_n_m_s": drag})
            for joint, model, (armature, drag) in zip(
                robot.joints, robot.servo_models, kept, strict=True
            )
        ]
    return with_keys(robot, changes, robot.name)


def robot_comment(constants: ServoConstants, paths: Sequence[Path]) -> str:
    """Words for the head of a robot's file: where its constants are from, and their intervals."""
    lines = [
        f"Servo constants found by `snakewalk robot identify` from {', '.join(map(str, paths))}."
    ]
    lines += [
        f"{constant.name.replace('_', ' ')} {constants[constant.name]:.4g}, 95 % of {low:.4g} to "
        f"{high:.4g}"
        for constant, low, high in zip(CONSTANTS, constants.low, constants.high, strict=True)
        if math.isfinite(low)
    ]
    return "\n".join(lines)
