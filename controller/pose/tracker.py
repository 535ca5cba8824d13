"""A simulated tracker: true poses of a body as poses with noise, delay, dropouts and swaps."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.pose import TrackerConfig
from snakewalk.controller.pose.datagram import encode_pose
from snakewalk.controller.pose.sample import PoseSample
from snakewalk.controller.pose.tracked_body import TrackedBody
from snakewalk.drivers.attitude import rotation_by
from snakewalk.drivers.types import BodyPose

FRAME = "world"


_DATAGRAM_AGE_S = 1.0
"""Longest time for which a datagram waits for its reader (ours)."""


class Sent(NamedTuple):
    """A datagram of a tracker."""

    due_s: float
    """Time of arrival on the clock of the servos."""
    data: bytes


class SimulatedTracker:
    """Measures a body in regular intervals; every chance comes from the seed."""

    def __init__(self, config: TrackerConfig, body: TrackedBody, seed: int = 0) -> None:
        self.config = config
        self._body = body
        self._rng = np.random.default_rng([seed, 0x7AC])
        self._noise = np.zeros(6)
        self._sequence = 0
        self._dropout_until_s = self._swap_until_s = -np.inf
        self._swap = np.zeros(3)
        self._outgoing: deque[Sent] = deque()
        self.clock: Callable[[float], float] = lambda time_s: time_s
        """Time of the tracker's clock, before offset and drift, for a time of the servos."""

    def measure(self, head: BodyPose, joint_rad: Floats) -> tuple[int, float | None]:
        """Measure the body; returns the number of the pose, and when it arrives, or None."""
        config = self.config
        rng = self._rng
        now_s = head.time_s
        position_m, axes = self._body.body(head, joint_rad)
        noise = self._next_noise()
        if self._begins(config.swap_every_s):
            self._swap_until_s = now_s + config.swap_s
            direction = rng.standard_normal(3)
            self._swap = config.swap_m * direction / np.linalg.norm(direction)
        if self._begins(config.dropout_every_s):
            self._dropout_until_s = now_s + config.dropout_s
        swapped = self._swap if now_s < self._swap_until_s else np.zeros(3)
        is_lost = rng.random() < config.lost_share or now_s < self._dropout_until_s
        delay_s = config.delay_s + config.jitter_s * rng.random()
        sequence = self._sequence
        self._sequence += 1
        if is_lost:
            return sequence, None
        sample = PoseSample(
            sequence,
            self.clock(now_s) * (1.0 + 1e-6 * config.clock_drift_ppm) + config.clock_offset_s,
            position_m + noise[:3] + swapped,
            rotation_by(noise[3:]) @ axes,
            FRAME,
            self._covariance(),
        )
        while self._outgoing and self._outgoing[0].due_s < now_s - _DATAGRAM_AGE_S:
            self._outgoing.popleft()  # nothing asks for them
        self._outgoing.append(Sent(now_s + delay_s, encode_pose(sample)))
        return sequence, now_s + delay_s

    def due(self, now_s: float) -> Sequence[Sent]:
        """Return the datagrams that are to arrive by now, in the order of their arrival."""
        waiting = self._outgoing
        self._outgoing = deque(outgoing for outgoing in waiting if outgoing.due_s > now_s)
        return sorted((outgoing for outgoing in waiting if outgoing.due_s <= now_s), key=_due_s)

    def _next_noise(self) -> Floats:
        config = self.config
        deviation = np.repeat([config.noise_m, np.radians(config.noise_deg)], 3)
        drawn = deviation * self._rng.standard_normal(6)
        if config.correlation_s == 0.0:
            return drawn
        correlation = (
            np.exp(-1.0 / (config.rate_hz * config.correlation_s)) if self._sequence else 0.0
        )
        self._noise = correlation * self._noise + np.sqrt(1.0 - correlation * correlation) * drawn
        return self._noise

    def _begins(self, every_s: float) -> bool:
        chance = self._rng.random()
        return bool(every_s > 0.0 and chance < 1.0 / (every_s * self.config.rate_hz))

    def _covariance(self) -> Floats | None:
        config = self.config
        if config.noise_m == 0.0 or config.noise_deg == 0.0:
            return None
        noise_rad = float(np.radians(config.noise_deg))
        return np.diag([config.noise_m**2] * 3 + [noise_rad**2] * 3)


def _due_s(sent: Sent) -> float:
    return sent.due_s
