"""A central pattern generator: one oscillator a joint, coupled along the body, for any gait.

The form is that of A. J. Ijspeert, A. Crespi, D. Ryczko, J.-M. Cabelguen, From swimming to walking
with a salamander robot driven by a spinal cord model, Science 315, 2007:

    theta_i' = omega + sum_j w sin(theta_j - theta_i - phi_ij),    q_i = x_i + r_i cos theta_i
    r_i'' = a (a/4 (R_i - r_i) - r_i'),  and the same for x_i

Three things are added. Each joint has the higher harmonics of its gait in addition to ``r_i``, so
that it also reproduces gaits that are not sine waves. The frequency and the phases between joints
go to new values by the same critically damped equation, instead of jumping: angles are then C1 at
every change. And the coupling does not fade with the amplitude, so that joints at rest pass the
phase on.

The phase differences ``phi_ij = beta_j - beta_i`` are those of a gait: with ``eps_i = theta_i - phi
- beta_i`` and ``phi' = omega`` the coupling reads ``eps_i' = sum_j w sin(eps_j - eps_i)``. All
neighbours are coupled and none in a ring, so every start but a set of measure 0 ends in step.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.cpg.pattern import HARMONICS, Pattern
from snakewalk.controller.gaits.cpg.trajectory import coupling_rates, peak_share, trajectory
from snakewalk.controller.gaits.wave import TURN

COUPLING_PER_S = 20.0
LONGEST_STEP_S = 0.01


@dataclass(frozen=True, slots=True)
class Damped:
    """A critically damped approach to a goal: ``z'' = a (a/4 (Z - z) - z')``.

    In closed form ``Z + (A + B t) e^(-a t/2)``, from a value and a rate.
    """

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
        return self.goal * t_s + self.left * fallen + self.slope * ramp


CpgState = tuple[Damped, Damped, float, float, Pattern]


class Cpg:
    """J oscillators, at rest until ``set_pattern``."""

    def __init__(self, joint_rad: Floats) -> None:
        """Start at rest at angles (J,)."""
        self.joints = len(joint_rad)
        self.pattern = Pattern.rest(joint_rad)
        self.phase_error_rad: Floats = np.zeros(self.joints)
        """(J,) eps: each oscillator's phase less that of the pattern; add to it to disturb them."""
        self._phase_rad = 0.0
        self._t_s = 0.0
        state = _packed_pattern(self.pattern, np.zeros(self.joints))
        still = np.zeros(1)
        self._slow = Damped.start(state, np.zeros_like(state), state, 1.0)
        self._clock = Damped.start(still, still, still, 1.0)

    def set_pattern(self, pattern: Pattern, gain: float, clock_gain: float | None = None) -> None:
        """Change to another pattern; amplitudes settle within about ``10 / gain`` seconds."""
        value, rate = self._slow.at(self._t_s)
        omega, omega_rate = self._clock.at(self._t_s)
        self._phase_rad = float(self._phase_rad + self._clock.sum(self._t_s)[0]) % TURN
        now = value[0]
        turn = np.where(np.isnan(pattern.bias_rad), 0.0, pattern.bias_rad - now)
        bias = now + np.mod(turn + np.pi, TURN) - np.pi  # the shorter way round
        omega_goal = np.array([pattern.omega_rad_s])
        self._slow = Damped.start(value, rate, _packed_pattern(pattern, bias), gain)
        self._clock = Damped.start(omega, omega_rate, omega_goal, clock_gain or gain)
        self._t_s = 0.0
        self.pattern = pattern

    def state(self) -> CpgState:
        """All state that changes, for ``restore``."""
        return self._slow, self._clock, self._t_s, self._phase_rad, self.pattern

    def restore(self, state: CpgState) -> None:
        """Restore a state that ``state`` returned."""
        self._slow, self._clock, self._t_s, self._phase_rad, self.pattern = state

    def advance(self, time_s: float) -> None:
        """Go on by a time."""
        self._t_s += time_s

    def step(self, dt_s: float) -> Floats:
        """Go on by ``dt_s``; returns the angles (J,)."""
        self._t_s += dt_s
        if self.phase_error_rad.any():
            parts = int(np.ceil(dt_s / LONGEST_STEP_S))
            for _ in range(parts):
                h, e = dt_s / parts, self.phase_error_rad
                coupling = _coupling(e)
                two = _coupling(e + 0.5 * h * coupling)
                three = _coupling(e + 0.5 * h * two)
                four = _coupling(e + h * three)
                self.phase_error_rad = e + h / 6.0 * (coupling + 2.0 * two + 2.0 * three + four)
        return self.angle_rad()

    def angle_rad(self) -> Floats:
        """(J,) now."""
        return np.asarray(self.predict(np.zeros(1))[0][0])

    def velocity_rad_s(self) -> Floats:
        """(J,) now."""
        return np.asarray(self.predict(np.zeros(1))[1][0])

    def predict(self, t_s: Floats) -> tuple[Floats, Floats]:
        """Angles and speeds (T, J) at times (T,) from now, ``phase_error_rad`` staying as it is."""
        angle, speed = np.empty((2, len(t_s), self.joints))
        trajectory(*self._trajectory_arguments(t_s), angle, speed)
        return angle, speed

    def peak_share(
        self, t_s: Floats, speed_rad_s: Floats, acceleration_rad_s2: Floats, enough: float
    ) -> tuple[float, Floats, Floats]:
        """Largest share of limits (J,) that is reached at even times (T,) from now.

        Returns:
            the share; the largest speeds and accelerations (J,). All are of the times up to the
            first at which the share is above ``enough``.

        """
        fast, hard = np.zeros((2, self.joints))
        limits = speed_rad_s, acceleration_rad_s2
        return peak_share(*self._trajectory_arguments(t_s), *limits, enough, fast, hard), fast, hard

    def _trajectory_arguments(
        self, t_s: Floats
    ) -> tuple[Floats, Floats, Floats, Floats, Floats, float, Floats, Floats]:
        """First arguments of the loops in ``trajectory``."""
        slow = self._slow
        turn = self._clock
        clock = np.array(
            [self._phase_rad, turn.goal[0], turn.left[0], turn.slope[0], 0.5 * turn.gain]
        )
        phase_error = self.phase_error_rad, _coupling(self.phase_error_rad)
        return (
            self._t_s + t_s,
            clock,
            slow.goal,
            slow.left,
            slow.slope,
            0.5 * slow.gain,
            *phase_error,
        )


def _packed_pattern(pattern: Pattern, bias_rad: Floats) -> Floats:
    """(2 + 2 HARMONICS, J) biases, offsets, real and imaginary parts of the amplitudes."""
    state = np.empty((2 + 2 * HARMONICS, len(bias_rad)))
    state[0], state[1] = bias_rad, pattern.offset_rad
    state[2 : 2 + HARMONICS] = pattern.harmonics_rad.real.T
    state[2 + HARMONICS :] = pattern.harmonics_rad.imag.T
    return state


def _coupling(phase_error_rad: Floats) -> Floats:
    """(J,) coupling of neighbours along the body."""
    out = np.empty(len(phase_error_rad))
    coupling_rates(phase_error_rad, COUPLING_PER_S, out)
    return out
