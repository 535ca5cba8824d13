"""A critically damped approach to a goal, in closed form: value, rate and integral at any time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Damped:
    """``z'' = a (a/4 (Z - z) - z')`` from a value and a rate: ``Z + (A + B t) e^(-a t/2)``."""

    goal: Complex
    left: Complex
    slope: Complex
    gain: float

    @staticmethod
    def start(value: Complex, rate: Complex, goal: Complex, gain: float) -> "Damped":
        """Begin from (n,) values and rates."""
        left = value - goal
        return Damped(goal, left, rate + 0.5 * gain * left, gain)

    def at(self, t_s: Floats) -> tuple[Complex, Complex]:
        """Value and rate at times (T,): (T, n) each."""
        t, h = t_s[:, None], 0.5 * self.gain
        fading = np.exp(-h * t)
        line = self.left + self.slope * t
        return self.goal + line * fading, (self.slope - h * line) * fading

    def sum(self, t_s: Floats) -> Complex:
        """Integral of the value from 0 to times (T,): (T, n)."""
        t, h = t_s[:, None], 0.5 * self.gain
        fading = np.exp(-h * t)
        fallen = (1.0 - fading) / h
        ramp = (fallen - t * fading) / h
        return np.asarray(self.goal * t + self.left * fallen + self.slope * ramp)
