"""A critically damped approach to a goal, in closed form: value, rate and integral at any time."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats


@dataclass(frozen=True, slots=True)
class Damped:
    """``z'' = a (a/4 (Z - z) - z')`` from a value and a rate: ``Z + (A + B t) e^(-a t/2)``."""

    goal: Floats
    left: Floats
    slope: Floats
    gain: float

    @staticmethod
    def start(value: Floats, rate: Floats, goal: Floats, gain: float) -> "Damped":
        """Begin from values and rates of any one shape."""
        left = value - goal
        return Damped(goal, left, rate + 0.5 * gain * left, gain)

    def at(self, t_s: Floats | float) -> tuple[Floats, Floats]:
        """Value and rate at a time, or one value's at times (T,)."""
        h = 0.5 * self.gain
        fading = np.exp(-h * t_s)
        line = self.left + self.slope * t_s
        return self.goal + line * fading, (self.slope - h * line) * fading

    def sum(self, t_s: Floats | float) -> Floats:
        """Integral of the value from 0 to a time, or one value's to times (T,)."""
        h = 0.5 * self.gain
        fading = np.exp(-h * t_s)
        fallen = (1.0 - fading) / h
        ramp = (fallen - t_s * fading) / h
        return np.asarray(self.goal * t_s + self.left * fallen + self.slope * ramp)
