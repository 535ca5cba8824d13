"""Synthesis of a motion without a robot ([PT] 2.6): rate, speed law, behaviour over time."""

from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator, Field, model_validator

from snakewalk.config.arrays import Floats
from snakewalk.config.base import Strict

Curve = float | tuple[tuple[float, float], ...]
"""A constant, or knots of time in seconds and value: linear between them, level beyond."""
Along = tuple[float, ...]
"""Factors at even places from head to tail, linear between them; one holds for the whole body."""


def _knots(curve: Curve) -> Curve:
    if not isinstance(curve, float | int):
        times = [t for t, _ in curve]
        if not times or any(b <= a for a, b in pairwise(times)):
            raise ValueError("knots [time_s, value], one or more, with times that increase")
    return curve


def _range_check(low: float, high: float) -> AfterValidator:
    def check(curve: Curve) -> Curve:
        if not all(low <= value <= high for value in _values(curve)):
            raise ValueError(f"values from {low:g} to {high:g}")
        return curve

    return AfterValidator(check)


def _check_not_empty(along: Along) -> Along:
    if not along:
        raise ValueError("one factor or more, from head to tail")
    return along


Knots = AfterValidator(_knots)
"""Knots of a ``Curve``: its times must increase."""
_NotEmpty = AfterValidator(_check_not_empty)
_Share = Annotated[Curve, Knots, _range_check(0.0, 1.0)]


def curve_at(curve: Curve, time_s: ArrayLike) -> Floats:
    """Value of a curve at times (...)."""
    if isinstance(curve, float | int):
        return np.full(np.shape(time_s), float(curve))
    times, values = zip(*curve, strict=True)
    return np.asarray(np.interp(np.asarray(time_s, float), times, values))


def _values(curve: Curve) -> tuple[float, ...]:
    return (float(curve),) if isinstance(curve, float | int) else tuple(v for _, v in curve)


def along_body(factors: Along, points: int) -> Floats:
    """(points,) factors from head to tail."""
    return np.interp(np.linspace(0.0, 1.0, points), np.linspace(0.0, 1.0, len(factors)), factors)


class WavesConfig(Strict):
    """Which waves the states of a synthesis have ([PT] 2.6.6, Fig. 13): parts of the library.

    All 0: the states are those of the recording, and random ones like them.
    """

    long: float = Field(
        0.0, ge=0.0, description="part of the long waves, coefficients 1-2: Fig. 13 (a)"
    )
    medium: float = Field(
        0.0, ge=0.0, description="part of the medium waves, coefficients 3-4: Fig. 13 (b)"
    )
    short: float = Field(
        0.0, ge=0.0, description="part of the short waves, coefficients 5-7: Fig. 13 (c)"
    )
    energy_share: float = Field(
        0.9, gt=0.0, le=1.0, description="least share of a state's energy in its coefficients"
    )

    @property
    def parts(self) -> dict[tuple[int, int], float]:
        """First and last coefficient of each wanted kind, and its share of the library."""
        bands = {(1, 2): self.long, (3, 4): self.medium, (5, 7): self.short}
        total = sum(bands.values())
        return {band: part / total for band, part in bands.items() if part > 0.0}


class Adaptation(StrEnum):
    """How a skeleton in the plane gets onto the ground ([PT] 2.6.5)."""

    ARC = "arc"
    HEIGHT = "height"


class SynthesisConfig(Strict):
    """`snakewalk animal synthesise`: a motion on paper ([PT] 2.6).

    A curve is a number or [[s, value]...].

    The constants of the speed law are those of [PT] 2.6.3, in a unit of length that is declared.
    """

    rate_hz: float = Field(25.0, ge=5.0, le=1000.0, description="number of frames per second")
    coefficients: int = Field(
        7, ge=1, le=20, description="number of principal components of a state"
    )
    for_robot: bool = Field(
        True,
        description="use only states that the robot can make and that push; "
        "otherwise all without self-contact",
    )
    state_share: float | None = Field(
        None,
        gt=0.05,
        le=1.0,
        description="share of each state that is walked, from its tail; default: "
        "walk.decision_fraction. walk-printed walks whole states",
    )
    ground: Adaptation = Field(
        Adaptation.ARC,
        description="arc: segments keep their length on the ground; height: points keep their "
        "place in the plane and get the ground's height, which stretches segments on slopes",
    )
    target_spacing_m: float = Field(
        0.6,
        gt=0.05,
        description="distance between targets on the path, in addition to the waypoints",
    )
    length_unit_m: float = Field(
        0.1, gt=0.0, description="unit of length of the constants c1 to c4"
    )
    viscous: float = Field(1.0, gt=0.0, description="viscous friction c1 of the speed law")
    coulomb: float = Field(0.5, ge=0.0, description="Coulomb friction c2 of the speed law")
    bend: float = Field(
        6.0, ge=0.0, description="loss c3 of the speed law per radian of the bends' deviation K"
    )
    turn: float = Field(
        1.0, ge=0.0, lt=2.0, description="loss c4 of the speed law per rad/s of turning"
    )
    sliding: _Share = Field(
        0.0, description="share w_d of the pulse that is lost by sliding; at 1 the body glides"
    )
    sliding_along: Annotated[Along, _NotEmpty] = Field(
        (1.0,), description="factors on w_d from head to tail"
    )
    pulse_m_s: Annotated[Curve, Knots, _range_check(-10.0, 10.0)] = Field(
        0.0, description="speed g of the pulse in addition to the body's speed"
    )
    pulse_along: Annotated[Along, _NotEmpty] = Field(
        (1.0,), description="factors on g from head to tail"
    )
    pulse_spread_m_s: float = Field(
        0.0, ge=0.0, le=10.0, description="bound of a random g, constant on parts of the body"
    )
    pulse_parts: int = Field(
        5, ge=1, le=100, description="number of parts of the body with a random g each"
    )
    pulse_step_m_s: float = Field(
        0.005, gt=0.0, description="largest change of a random g between parts and between frames"
    )
    waves: WavesConfig = WavesConfig()
    head_held: _Share = Field(
        0.0, description="share by which the head points along the body's heading"
    )
    calm_tail: _Share = Field(0.0, description="share by which the bends of the tail are flattened")
    tongue_speed: Annotated[Curve, Knots, _range_check(0.4, 2.5)] = Field(
        1.0, description="speed factor b_st of the tongue's flicks"
    )

    @model_validator(mode="after")
    def _waves_have_coefficients(self) -> Self:
        last = max((last for _, last in self.waves.parts), default=0)
        if last > self.coefficients:
            raise ValueError(
                f"waves: the wanted states need {last} coefficients, not {self.coefficients}"
            )
        if not all(0.0 <= f <= 1.0 for f in self.sliding_along):
            raise ValueError("sliding_along: factors from 0 to 1")
        if self.viscous / self.rate_hz >= 2.0:
            raise ValueError(
                f"viscous: below {2.0 * self.rate_hz:g} at this rate, otherwise the motion diverges"
            )
        return self
