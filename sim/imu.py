"""An IMU on the simulated line: its registers, filled from the motion of a link.

Readings are the mean rate (exactly the turn of the link) and the mean acceleration since the last
request, with a constant bias and noise. The device's filter, if any, computes the attitude from
them.
"""

from collections.abc import Callable

import numpy as np

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.robot import ImuConfig
from snakewalk.drivers.attitude import AttitudeFilter, rotations
from snakewalk.drivers.protocol.imu_table import IMU_TABLES, encode
from snakewalk.drivers.protocol.registers import BAUDS
from snakewalk.sim.plant import LinkMotion

_TABLE_BYTES = 256
_SAMPLE_PERIOD_S = 1e-4
"""Looks that follow each other faster see the same reading (ours)."""
_REACTION_TO_GRAVITY_M_S2 = np.array([0.0, 0.0, GRAVITY_M_S2])


class Imu:
    """The IMU of ``config`` on a line of ``baud``; ``motion`` returns the motion of its link."""

    def __init__(
        self,
        config: ImuConfig,
        motion: Callable[[], LinkMotion],
        baud: int = 1_000_000,
        seed: int = 0,
    ) -> None:
        self.config = config
        self.baud = baud
        self._motion, self._turn = motion, rotations()
        self._in_link = self._turn.from_euler("xyz", config.mounting_deg, degrees=True).as_matrix()
        self._random = np.random.default_rng(seed)
        self._bias_rad_s = np.deg2rad(config.gyro_bias_dps) * self._random.standard_normal(3)
        self._filter = AttitudeFilter()
        self._table = np.zeros(_TABLE_BYTES, np.uint8)
        self._public = IMU_TABLES[config.model]
        self._starts = {register.address for register in self._public.registers.values()}
        self._last: LinkMotion | None = None
        self._velocity_m_s = np.zeros(3)
        self._start_s = motion().time_s
        for name, value in self._identity().items():
            self._set_register(name, value)

    @property
    def model_number(self) -> int:
        """Model number in a ping; 0 if it is not published."""
        return self._public.model_number or 0

    def block(self, address: int, length: int) -> bytes | None:
        """Bytes of a read; None if no register begins at ``address``."""
        if address not in self._starts or not 0 < length <= _TABLE_BYTES - address:
            return None
        self._measure_if_due()
        return self._table[address : address + length].tobytes()

    def _measure_if_due(self) -> None:
        """Measure, unless the last measurement is recent."""
        now, last = self._motion(), self._last
        step_s = 0.0 if last is None else now.time_s - last.time_s
        if last is not None and step_s < _SAMPLE_PERIOD_S:
            return
        rotation = now.rotation @ self._in_link
        rate = np.zeros(3)
        velocity = self._velocity_m_s
        acceleration = np.zeros(3)
        if last is not None:
            before = last.rotation @ self._in_link
            rate = self._turn.from_matrix(before.T @ rotation).as_rotvec() / step_s
            velocity = (now.centre_m - last.centre_m) / step_s
            acceleration = (velocity - self._velocity_m_s) / step_s
        self._last = now
        self._velocity_m_s = velocity
        noise = self._random.standard_normal((2, 3))
        rate = rate + self._bias_rad_s + np.deg2rad(self.config.gyro_noise_dps) * noise[0]
        force = (
            rotation.T @ (acceleration + _REACTION_TO_GRAVITY_M_S2)
            + self.config.acceleration_noise_m_s2 * noise[1]
        )
        attitude = self._filter.update(rate, force, step_s)
        shown = np.frombuffer(encode(self.config, rate, force, attitude), np.uint8)
        self._table[self._public.address : self._public.address + len(shown)] = shown
        since_s = now.time_s - self._start_s
        for name, value in {
            "Micros": int(since_s * 1e6),
            "Millis": int(since_s * 1e3),
            "IMU TIMESTAMP": int(since_s * 1e6),
        }.items():
            self._set_register(name, value & 0xFFFF_FFFF)

    def _identity(self) -> dict[str, int]:
        return {
            "Model Number": self.model_number,
            "Firmware_Version_Major": 1,
            "ID": self.config.id,
            "Baud Rate (Bus)": BAUDS.index(self.baud),
        }

    def _set_register(self, name: str, value: int) -> None:
        register = self._public.registers.get(name)
        if register is not None:
            data = np.frombuffer(register.encode(value), np.uint8)
            self._table[register.address : register.address + register.size] = data
