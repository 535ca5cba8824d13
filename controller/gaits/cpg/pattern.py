"""The goal of a pattern generator's oscillators: a gait as Fourier series of its joints."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Complexes, Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.gaits.wave import TURN

HARMONICS = 24
SAMPLES = 256
STILL_RAD = 1e-6
"""Amplitude below which a joint has no phase of its own."""


@dataclass(frozen=True, slots=True)
class Pattern:
    """Goal values of the oscillators."""

    omega_rad_s: float
    offset_rad: Floats
    """(J,) X"""
    bias_rad: Floats
    """(J,) beta: phase of each joint's first harmonic; NaN if it is zero."""
    harmonics_rad: Complexes
    """(J, HARMONICS) amplitudes ``d`` of ``Re(d e^(i k theta))``; the first is R, real."""

    @staticmethod
    def of(gait: Gait, robot: RobotConfig, omega_rad_s: float) -> "Pattern":
        """Fourier series of a gait's joints over its phase.

        Raises:
            InputError: the robot lacks joints that the gait needs.

        """
        joints = gait.joints_rad(robot, np.arange(SAMPLES) * TURN / SAMPLES)
        series = np.fft.rfft(joints, axis=0).T / SAMPLES
        waves = 2.0 * series[:, 1 : HARMONICS + 1]
        moves = np.abs(waves[:, 0]) > STILL_RAD
        bias = np.where(moves, np.angle(waves[:, 0]), np.nan)
        order = np.arange(1, HARMONICS + 1)
        waves = waves * np.exp(-1j * order * np.nan_to_num(bias)[:, None])
        return Pattern(omega_rad_s, series[:, 0].real.copy(), bias, waves)

    @staticmethod
    def rest(joint_rad: Floats) -> "Pattern":
        """Joints (J,) that stay where they are."""
        count = len(joint_rad)
        waves = np.zeros((count, HARMONICS), dtype=np.complex128)
        return Pattern(0.0, np.array(joint_rad, dtype=float), np.full(count, np.nan), waves)
