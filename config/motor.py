"""Constants of a chain's motors and gears, if better known than from the catalogue."""

from pydantic import Field

from snakewalk.config.base import Share, Strict


class MotorConfig(Strict):
    """Constants of the motors and gears of one's own servos, in simulation (docs/identify.md).

    They stand in place of those of ``servo.model``, for each joint that has a servo of this model;
    inertia and viscous friction are ``armature_kg_m2`` and ``gear_drag_n_m_s`` of ``[servo]``.
    """

    torque_constant_n_m_a: float | None = Field(
        None,
        gt=0.001,
        le=100.0,
        description="torque per ampere at the output shaft; default: the model's",
    )
    back_emf_v_s: float | None = Field(
        None,
        gt=0.001,
        le=100.0,
        description="back-EMF constant at the output shaft; default: "
        "torque_constant_n_m_a, else the model's",
    )
    resistance_ohm: float | None = Field(
        None,
        gt=0.01,
        le=1000.0,
        description="resistance of winding and bridge; default: the model's",
    )
    p_unit_per_rad: float | None = Field(
        None,
        gt=0.0,
        le=1.0,
        description="share of the supply for a radian of error and a unit of the P gain; default: "
        "the model's",
    )
    dry_n_m: float = Field(0.0, ge=0.0, le=10.0, description="friction without load")
    stribeck_n_m: float = Field(
        0.0, ge=0.0, le=10.0, description="additional friction of a slow shaft"
    )
    stribeck_rad_s: float = Field(
        0.3, gt=0.0, le=100.0, description="speed up to which the shaft is slow"
    )
    stribeck_exponent: float = Field(
        2.0, gt=0.0, le=20.0, description="exponent of the fading of a slow shaft's friction"
    )
    by_motor: Share = Field(0.0, description="friction as a share of the motor's torque")
    by_load: Share = Field(0.0, description="friction as a share of the load's torque")
    by_motor_slow: Share = Field(
        0.0,
        description="additional share of the motor's torque while the shaft is slow",
    )
    by_load_slow: Share = Field(
        0.0,
        description="additional share of the load's torque while the shaft is slow",
    )
    by_motor_square: float = Field(
        0.0,
        ge=0.0,
        le=10.0,
        description="friction per square of the motor's torque while the load is stronger, per N m",
    )
    by_load_square: float = Field(
        0.0,
        ge=0.0,
        le=10.0,
        description="friction per square of the load's torque while the motor is stronger, per N m",
    )
    backlash_rad: float = Field(
        0.0,
        ge=0.0,
        le=0.2,
        description="play of the shaft from end to end while the motor rests",
    )
