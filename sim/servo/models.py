"""What the e-manual says of each simulated model: its page's control table and specifications.

One row a model, from its page's "Control Table of EEPROM Area", "of RAM Area" and "Specifications"
(the figures at the recommended voltage); XD models share the motors of their XH twins. What no page
gives is marked. Everything else follows from these rows in ``sim.servo.register_rules`` (initial
values and ranges) and ``sim.servo.motor`` (resistance, torque constant, back-EMF).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from snakewalk.drivers.errors import ControlTableError


@dataclass(frozen=True, slots=True)
class Gains:
    """Initial values of the gain registers 76, 78, 80, 82 and 84."""

    velocity_i: int = 1_920
    velocity_p: int = 100
    position_d: int = 0
    position_i: int = 0
    position_p: int = 800


@dataclass(frozen=True, slots=True)
class ModelFacts:
    """One row."""

    nominal_v: float
    stall_torque_n_m: float
    no_load_rpm: float
    velocity_limit: int
    """Initial value of Velocity Limit(44), 0.229 rev/min."""
    current_limit: int | None = None
    """Initial and greatest Current Limit(38); None: the model measures no current."""
    volts: tuple[int, int] = (95, 160)
    """Range of Min and Max Voltage Limit(34, 32), and their initial values, 0.1 V."""
    min_volts: int | None = None
    """Initial Min Voltage Limit(34) where it is not the range's low end."""
    gains: Gains = field(default=Gains())
    temperature_limit_c: int = 80
    velocity_range: int = 1_023
    shutdown: int = 52
    moving_threshold: int = 10
    pwm_slope: int | None = None
    standby_a: float = 0.040


def _small(  # XL330 and XC330: another microcontroller, an extra register
    volts: float,
    torque: float,
    rpm: float,
    limit: int,
    current: int,
    gains: Gains,
    *,
    shutdown: int = 52,
    range_v: tuple[int, int] = (31, 70),
    min_v: int = 35,
    slope: int = 140,
) -> ModelFacts:
    return ModelFacts(
        volts,
        torque,
        rpm,
        limit,
        current,
        range_v,
        min_v,
        gains,
        70,
        2_047,
        shutdown,
        pwm_slope=slope,
        standby_a=0.017,
    )


_P900 = Gains(position_p=900)
MODELS: Mapping[str, ModelFacts] = {
    "XL330-M077": _small(5.0, 0.215, 383, 1_620, 1_750, Gains(400, 40, 0, 400, 400), shutdown=53),
    "XL330-M288": _small(5.0, 0.52, 103, 445, 1_750, Gains(1_600, 180, 0, 0, 400), shutdown=53),
    "XC330-M181": _small(5.0, 0.60, 129, 545, 2_352, Gains(1_400, 100, 500, 0, 1_200)),
    "XC330-M288": _small(5.0, 0.93, 81, 350, 2_352, Gains(1_600, 50, 500, 0, 1_100)),
    "XC330-T181": _small(
        *(11.1, 0.76, 104, 510, 910, Gains(1_200, 40, 0, 0, 900)),
        range_v=(55, 140),
        min_v=55,
        slope=255,
    ),
    "XC330-T288": _small(
        *(11.1, 0.92, 65, 320, 910, Gains(1_200, 40, 0, 0, 900)),
        range_v=(55, 140),
        min_v=55,
        slope=255,
    ),
    "XL430-W250": ModelFacts(
        *(11.1, 1.4, 57, 265),
        gains=Gains(1_000, 100, 4_000, 0, 640),
        standby_a=0.052,
        volts=(60, 140),
        temperature_limit_c=72,
    ),
    "2XL430-W250": ModelFacts(
        *(11.1, 1.4, 57, 250),
        gains=Gains(1_800, 100, 2_000, 0, 640),
        standby_a=0.049,
        volts=(60, 140),
        temperature_limit_c=72,
    ),
    "XC430-W150": ModelFacts(
        *(12.0, 1.6, 106, 460),
        gains=Gains(position_p=460),
        standby_a=0.046,
        moving_threshold=20,
        volts=(60, 160),
    ),
    "XC430-W240": ModelFacts(
        12.0, 1.9, 70, 306, gains=Gains(position_p=700), standby_a=0.046, volts=(60, 160)
    ),
    "2XC430-W250": ModelFacts(
        12.0, 1.8, 64, 275, gains=Gains(position_p=700), standby_a=0.049, volts=(60, 160)
    ),
    "XM430-W210": ModelFacts(12.0, 3.0, 77, 330, 1_193),
    "XM430-W350": ModelFacts(12.0, 4.1, 46, 200, 1_193),
    "XH430-W210": ModelFacts(12.0, 2.5, 50, 360, 648, gains=_P900),
    "XH430-W350": ModelFacts(12.0, 3.4, 30, 130, 648, gains=_P900),
    "XH430-V210": ModelFacts(24.0, 2.6, 52, 380, 689, volts=(110, 300), standby_a=0.036),
    "XH430-V350": ModelFacts(24.0, 3.3, 31, 285, 689, volts=(110, 300), standby_a=0.036),
    "XD430-T210": ModelFacts(12.0, 2.5, 50, 360, 648, gains=_P900),
    "XD430-T350": ModelFacts(12.0, 3.4, 30, 130, 648, gains=_P900),
    # No specifications in the page's data: motor of XH430-W350, speed from Velocity Limit.
    "XW430-T333": ModelFacts(12.0, 3.4, 32, 139, 2_047, gains=_P900),
    "XM540-W150": ModelFacts(12.0, 7.3, 53, 230, 2_047),
    "XM540-W270": ModelFacts(12.0, 10.6, 30, 128, 2_047),
    "XH540-W150": ModelFacts(12.0, 7.1, 70, 300, 2_047),
    "XH540-W270": ModelFacts(12.0, 9.9, 39, 167, 2_047),
    "XH540-V150": ModelFacts(24.0, 6.4, 60, 230, 1_188, volts=(110, 300), standby_a=0.036),
    "XH540-V270": ModelFacts(24.0, 9.2, 34, 128, 2_047, volts=(110, 300), standby_a=0.036),
    "XD540-T150": ModelFacts(12.0, 7.1, 70, 300, 2_047),
    "XD540-T270": ModelFacts(12.0, 9.9, 39, 167, 2_047),
    "XW540-T140": ModelFacts(12.0, 6.9, 72, 304, 2_047),
    "XW540-T260": ModelFacts(12.0, 9.5, 40, 167, 2_047),
    # No specifications in the page's data: motor of XH540-V270, speed from Velocity Limit.
    "XW540-H260": ModelFacts(24.0, 9.2, 33, 145, 1_188, volts=(110, 300), standby_a=0.036),
}
"""The whole X series of the SDK's control tables, by the name printed on the servo."""


def facts_of(model: str) -> ModelFacts:
    """Row of a model.

    Raises:
        ControlTableError: the model cannot be simulated.

    """
    try:
        return MODELS[model]
    except KeyError:
        known = ", ".join(MODELS)
        raise ControlTableError(f"{model}: not simulated; those that are: {known}") from None
