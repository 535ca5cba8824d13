"""The IMU of a robot on its bus: bytes to the attitude of its link."""

from collections.abc import Callable

import numpy as np
import scipy  # scipy.spatial loads when it is first used

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import ImuConfig
from snakewalk.drivers.attitude import AttitudeFilter
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.errors import ChainError, NoAnswerError
from snakewalk.drivers.protocol.imu_table import BLOCK_BYTES, IMU_TABLES, ImuSample, decode
from snakewalk.drivers.types import ImuState

SILENT_S = 1.0
"""A pause without a reading of this length is reported (ours)."""


class ImuReader:
    """Reads the IMU of ``config`` on ``bus``."""

    def __init__(self, bus: ChainBus, config: ImuConfig) -> None:
        self._bus, self._config, self._port = bus, config, bus.port_of(config.id)
        self._cycle = bus.device_block(config.id, IMU_TABLES[config.model].address, BLOCK_BYTES)
        in_link = scipy.spatial.transform.Rotation.from_euler(
            "xyz", config.mounting_deg, degrees=True
        ).as_matrix()
        self._to_link: Floats = np.asarray(in_link)
        self._filter = AttitudeFilter()
        self._measured_at_s = -np.inf
        self._silent = False
        self._state: ImuState | None = None

    def find(self) -> None:
        """Check its presence.

        Raises:
            ChainError: it does not reply, or is another device.
            PortError: the port is gone.

        """
        config = self._config
        number = IMU_TABLES[self._config.model].model_number
        try:
            reply = self._bus.ping(config.id)
        except NoAnswerError:
            raise ChainError(
                f"imu (ID {config.id}): no reply at {self._port.getBaudRate()} baud; check "
                "power, cable, id and baud rate, or remove [imu] from the robot's file"
            ) from None
        if number is not None and reply.model_number != number:
            raise ChainError(
                f"imu (ID {config.id}): is of model number {reply.model_number}, a {config.model} "
                f"has {number}"
            )

    def read(self, on_event: Callable[[str], None]) -> ImuState | None:
        """Read once; None before the first attitude, the old state if the IMU is silent.

        Raises:
            PortError: the port is gone.

        """
        reply = self._cycle.read()
        now_s = self._port.clock.now_s()
        measured_at_s = now_s - self._cycle.since_sent_s
        if reply.valid[0]:
            self._store_sample(decode(self._config, reply.data[0].tobytes()), measured_at_s)
        valid = self._measured_at_s == measured_at_s
        if self._state is None:
            return None
        age_s = now_s - self._measured_at_s
        if self._silent is not (age_s > SILENT_S):
            self._silent = not self._silent
            what = f"silent for {age_s:.1f} s" if self._silent else "answers again"
            on_event(f"imu (ID {self._config.id}): {what}")
        return self._state._replace(age_s=age_s, valid=valid)

    def _store_sample(self, sample: ImuSample, measured_at_s: float) -> None:
        rotation = sample.rotation
        if rotation is None and sample.acceleration_m_s2 is not None:
            step_s = measured_at_s - self._measured_at_s
            first = not np.isfinite(step_s)
            rotation = self._filter.update(
                sample.rate_rad_s, sample.acceleration_m_s2, 0.0 if first else step_s
            )
        if rotation is None:  # its own filter does not run yet
            return
        self._measured_at_s = measured_at_s
        self._state = ImuState(
            rotation=_constant(rotation @ self._to_link.T),
            rate_rad_s=_constant(self._to_link @ sample.rate_rad_s),
            age_s=0.0,
            valid=True,
        )


def _constant(array: Floats) -> Floats:
    array.setflags(write=False)
    return array
