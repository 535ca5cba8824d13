"""A central pattern generator: one oscillator a joint, coupled along the body, that takes any gait.

The form is that of A. J. Ijspeert, A. Crespi, D. Ryczko, J.-M. Cabelguen, From swimming to walking
with a salamander robot driven by a spinal cord model, Science 315, 2007:

    theta_i' = omega + sum_j w sin(theta_j - theta_i - phi_ij),    q_i = x_i + r_i cos theta_i
    r_i'' = a (a/4 (R_i - r_i) - r_i'),  and the same for x_i

Three things are added. Each joint has the higher harmonics of its gait beside ``r_i``, so that
gaits which are no sine waves are met too. The frequency and the phases between joints go to new
values by the same critically damped equation, instead of jumping: angles are then C1 at every
change. And the coupling does not fade with the amplitude, so that joints at rest pass the phase on.

The phase differences ``phi_ij = beta_j - beta_i`` are those of a gait: with ``eps_i = theta_i - phi
- beta_i`` and ``phi' = omega`` the coupling reads ``eps_i' = sum_j w sin(eps_j - eps_i)``. All
neighbours are coupled and none in a ring, so every start but a set of measure 0 ends in step.
"""

import numpy as np
from numpy.typing import NDArray

from controller.gaits.cpg_pattern import HARMONICS, Pattern
from controller.gaits.damped import Damped
from controller.gaits.wave import TURN

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

COUPLING_PER_S = 20.0
LONGEST_STEP_S = 0.01
CpgState = tuple[Damped, Damped, float, float, Pattern]


class Cpg:
    """J oscillators, at rest until ``become``."""

    def __init__(self, joint_rad: Floats) -> None:
        """Start at rest at angles (J,)."""
        self.joints = len(joint_rad)
        self.pattern = Pattern.rest(joint_rad)
        self.astray_rad: Floats = np.zeros(self.joints)
        """(J,) eps: each oscillator's phase less that of the pattern; add to it to disturb them."""
        self._phase_rad = 0.0
        self._t_s = 0.0
        state = np.concatenate([self._pack(self.pattern, np.zeros(self.joints)), [0.0]])
        none = np.zeros_like(state)
        self._slow = Damped.start(state[:-1], none[:-1], state[:-1], 1.0)
        self._clock = Damped.start(state[-1:], none[-1:], state[-1:], 1.0)

    def become(self, pattern: Pattern, gain: float = 6.0, clock_gain: float | None = None) -> None:
        """Go to another pattern; amplitudes settle within about ``10 / gain`` seconds."""
        value, rate = self._slow.at(np.array([self._t_s]))
        omega, omega_rate = self._clock.at(np.array([self._t_s]))
        self._phase_rad = self._phase(np.array([self._t_s]))[0] % TURN
        now = value[0, : self.joints].real
        turn = np.nan_to_num(pattern.bias_rad - now)
        bias = now + np.mod(turn + np.pi, TURN) - np.pi  # the shorter way round
        goal = self._pack(pattern, bias)
        wanted = np.array([pattern.omega_rad_s], dtype=np.complex128)
        self._slow = Damped.start(value[0], rate[0], goal, gain)
        self._clock = Damped.start(omega[0], omega_rate[0], wanted, clock_gain or gain)
        self._t_s = 0.0
        self.pattern = pattern

    def now(self) -> CpgState:
        """Everything that changes, for ``restore``."""
        return self._slow, self._clock, self._t_s, self._phase_rad, self.pattern

    def restore(self, state: CpgState) -> None:
        """Go back to what ``now`` returned."""
        self._slow, self._clock, self._t_s, self._phase_rad, self.pattern = state

    def skip(self, time_s: float) -> None:
        """Go on by a time without looking."""
        self._t_s += time_s

    def step(self, dt_s: float) -> Floats:
        """Go on by ``dt_s``; returns the angles (J,)."""
        self._t_s += dt_s
        if self.astray_rad.any():
            parts = int(np.ceil(dt_s / LONGEST_STEP_S))
            for _ in range(parts):
                h, e = dt_s / parts, self.astray_rad
                one = _pull(e)
                two = _pull(e + 0.5 * h * one)
                three = _pull(e + 0.5 * h * two)
                four = _pull(e + h * three)
                self.astray_rad = e + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        return self.angle_rad()

    def angle_rad(self) -> Floats:
        """(J,) now."""
        return np.asarray(self._read(np.array([self._t_s]))[0][0])

    def velocity_rad_s(self) -> Floats:
        """(J,) now."""
        return np.asarray(self._read(np.array([self._t_s]))[1][0])

    def ahead(self, t_s: Floats) -> tuple[Floats, Floats]:
        """Angles and speeds (T, J) at times (T,) from now, ``astray_rad`` staying as it is."""
        return self._read(self._t_s + t_s)

    def _phase(self, t_s: Floats) -> Floats:
        return np.asarray(self._phase_rad + self._clock.sum(t_s)[:, 0].real)

    def _pack(self, pattern: Pattern, bias_rad: Floats) -> Complex:
        waves = pattern.harmonics_rad.ravel()
        return np.concatenate([bias_rad, pattern.offset_rad, waves]).astype(np.complex128)

    def _read(self, t_s: Floats) -> tuple[Floats, Floats]:
        value, rate = self._slow.at(t_s)
        n, shape = self.joints, (len(t_s), self.joints, HARMONICS)
        theta = self._phase(t_s)[:, None] + value[:, :n].real + self.astray_rad
        omega = self._clock.at(t_s)[0].real
        turning = omega + rate[:, :n].real + _pull(self.astray_rad)
        order = np.arange(1, HARMONICS + 1)
        wave = np.exp(1j * theta[:, :, None] * order)
        d, d_rate = value[:, 2 * n :].reshape(shape), rate[:, 2 * n :].reshape(shape)
        angle = value[:, n : 2 * n].real + (d * wave).sum(axis=2).real
        spin = 1j * order * turning[:, :, None] * d
        speed = rate[:, n : 2 * n].real + ((d_rate + spin) * wave).sum(axis=2).real
        return angle, speed


def _pull(astray_rad: Floats) -> Floats:
    """(J,) coupling of neighbours along the body."""
    pull = COUPLING_PER_S * np.sin(np.diff(astray_rad))
    out = np.zeros(len(astray_rad))
    out[:-1] += pull
    out[1:] -= pull
    return out
