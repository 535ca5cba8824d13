"""Statistics of the poses that arrive: rate, delay, noise, frame and senders."""

import math
from collections import deque
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.pose import PoseConfig
from snakewalk.controller.pose.sample import ArrivedPose, PoseSample, UnusablePoseError
from snakewalk.controller.pose.sender_clock import SenderClock
from snakewalk.controller.pose.senders import Senders
from snakewalk.controller.pose.tracked_body import tracked_link
from snakewalk.drivers.attitude import heading_of

MOST = 2000
"""Newest poses that count."""


class FeedStatistics:
    """Call ``add`` with each pose that arrives."""

    def __init__(self, config: PoseConfig) -> None:
        self._config = config
        self._clock = SenderClock()
        self._poses: deque[tuple[float, float, PoseSample]] = deque(maxlen=MOST)
        """Arrival, delay and pose."""
        self._order = Senders(config.sender)
        self._others: list[str] = []
        self.invalid = 0
        """Messages without a usable pose."""
        self.last_fault = ""
        self.senders: list[str] = []
        self.frames: list[str] = []

    def add(self, arrived: ArrivedPose) -> None:
        """Count a message."""
        placed = self._order.place(arrived)
        if arrived.sender not in self.senders:
            self.senders.append(arrived.sender)
            if placed.order == "other":
                self._others.append(placed.text)
        if placed.order == "other":
            return
        sample = arrived.sample
        if isinstance(sample, UnusablePoseError):
            self.invalid += 1
            self.last_fault = str(sample)
            return
        if sample.frame not in self.frames:
            self.frames.append(sample.frame)
        self._clock.add(sample.time_s, arrived.arrival_s)
        late_s = arrived.arrival_s - self._clock.local_s(sample.time_s, arrived.arrival_s)
        self._poses.append((arrived.arrival_s, late_s, sample))

    @property
    def newest(self) -> PoseSample | None:
        """The newest pose."""
        return self._poses[-1][2] if self._poses else None

    @property
    def samples(self) -> list[PoseSample]:
        """The newest poses."""
        return [sample for _, _, sample in self._poses]

    def faults(self) -> list[str]:
        """Return contradictions among the messages, one line each."""
        problems = []
        if not self._poses:
            problems.append(self.last_fault or "nothing arrived; start the sender")
        problems += self._others
        if len(self.frames) > 1:
            problems.append(f"wrong frame: poses name {', '.join(self.frames)}; send one frame")
        return problems

    def facts(self) -> dict[str, Any]:
        """Return the numbers, for a command's answer."""
        facts: dict[str, Any] = {
            "poses": len(self._poses),
            "invalid": self.invalid,
            "lost": self._order.lost,
            "senders": list(self.senders),
            "frame": self.frames[0] if self.frames else None,
        }
        if not self._poses:
            return facts
        arrival_s = np.array([row[0] for row in self._poses])
        late_s = np.array([row[1] for row in self._poses])
        span_s = float(arrival_s[-1] - arrival_s[0])
        position_m, axes = tracked_link(self._poses[-1][2], self._config)
        return facts | {
            "rate_hz": round((len(self._poses) - 1) / span_s, 1) if span_s > 0.0 else None,
            "longest_gap_s": _rounded_value(np.diff(arrival_s).max(initial=0.0)),
            "jitter_mean_s": _rounded_value(late_s.mean()),
            "jitter_max_s": _rounded_value(late_s.max()),
            "noise_m": self._noise_m(),
            "noise_deg": self._noise_deg(),
            "position_m": position_m.round(4).tolist(),
            "heading_deg": round(math.degrees(heading_of(axes)), 1),
            "up": axes[:, 2].round(3).tolist(),
        }

    def _noise_m(self) -> float | None:
        """Standard deviation of a coordinate; slow motion does not count."""
        positions = np.array([sample.position_m for sample in self.samples])
        if len(positions) < 10:
            return None
        return _rounded_value(np.sqrt(np.mean(np.diff(positions, 2, axis=0) ** 2) / 6.0))

    def _noise_deg(self) -> float | None:
        """Standard deviation of an angle; slow motion does not count."""
        if len(self._poses) < 10:
            return None
        turns = Rotation.from_matrix([sample.rotation for sample in self.samples])
        steps = (turns[1:] * turns[:-1].inv()).as_rotvec()
        return round(math.degrees(np.sqrt(np.mean(np.diff(steps, axis=0) ** 2) / 6.0)), 2)


def _rounded_value(value: float) -> float:
    return round(float(value), 4)
