"""Whether measured poses move like the joints: unit, axes, handedness and frame.

Dead reckoning gives turn and displacement of the head between two measurements. Mirrored axes turn
the other way, millimetres move a thousand times as far, and a turned frame moves in another
direction than the head.
"""

from collections import deque
from typing import Final

import numpy as np

from snakewalk.controller.pose.motion_history import Moment
from snakewalk.controller.pose.tracked_body import HeadMeasurement

STEP_S: Final = 0.4
"""Time between two measurements that are compared (ours)."""
WINDOW: Final = 16
"""Comparisons that count."""
LEAST: Final = 7
"""Comparisons before a fault is reported (ours)."""
LEAST_UP: Final = 0.7
"""Least cosine between the head's up axis and the vertical (ours)."""
LEAST_TURN_RAD2: Final = 0.2
LEAST_WAY_M2: Final = 0.01
"""Sums of squares before a fault is reported: below, noise decides (ours)."""
SCALE: Final = 20.0
"""A motion that is this many times larger than expected has another unit (ours)."""
TURNED_RAD: Final = 1.0
"""Direction beyond which the frame is turned (ours)."""
SHARE: Final = 0.8
"""Least correlation with which a fault is reported (ours)."""
AGREED: Final = 0.6
"""Least correlation with which a source agrees with the joints (ours)."""
STILL_RAD: Final = 0.02
STILL_M: Final = 0.004
"""A head that turns and moves less than this between two measurements shows nothing (ours): a run
that holds keeps what its motion has shown."""


class MotionCheck:
    """Call ``add`` with each measurement, in order of time."""

    def __init__(self) -> None:
        self._last: tuple[Moment, HeadMeasurement] | None = None
        self._turns: deque[tuple[float, float]] = deque(maxlen=WINDOW)
        self._ways: deque[tuple[complex, complex]] = deque(maxlen=WINDOW)
        self.fault: str | None = None
        """How the source contradicts the joints; None while it does not."""
        self.has_agreed = False
        """Whether the turns and directions of the source have agreed with the joints before."""

    def forget(self) -> None:
        """Begin again after a body moved without its joints; ``has_agreed`` stays."""
        self._last = None
        self._turns.clear()
        self._ways.clear()
        self.fault = None

    def add(self, measured: HeadMeasurement, then: Moment) -> None:
        """Compare a measurement with the one before; a head that lies on its side shows nothing."""
        if measured.rotation[2, 2] < LEAST_UP:
            self._last = None
            return
        if self._last is None or then.time_s - self._last[0].time_s > 2.0 * STEP_S:
            self._last = (then, measured)
            return
        before, last_head = self._last
        if then.time_s - before.time_s < STEP_S:
            return
        self._last = (then, measured)
        turn = then.place[2] - before.place[2]
        if abs(turn) < STILL_RAD and np.hypot(*(then.place[:2] - before.place[:2])) < STILL_M:
            return
        seen_turn = _heading(measured) - _heading(last_head)
        self._turns.append((float(turn), float(np.arctan2(np.sin(seen_turn), np.cos(seen_turn)))))
        direction = complex(*(then.place[:2] - before.place[:2]))
        direction *= np.exp(1j * (_heading(last_head) - before.place[2]))
        self._ways.append((direction, complex(*(measured.position_m - last_head.position_m)[:2])))
        self.fault = self._judge()

    def _judge(self) -> str | None:
        if len(self._turns) < LEAST:
            return None
        expected, measured = (np.array(column) for column in zip(*self._turns, strict=True))
        turned = float(expected @ expected)
        if turned > LEAST_TURN_RAD2 and _correlation(expected, measured) < -SHARE:
            return (
                "mirrored axes: the head turns the other way than its joints say; send a "
                "right-handed frame, z up"
            )
        expected_ways, measured_ways = (
            np.array(column) for column in zip(*self._ways, strict=True)
        )
        expected_size = float(np.vdot(expected_ways, expected_ways).real)
        if expected_size < LEAST_WAY_M2:
            return None
        same = np.vdot(expected_ways, measured_ways)
        mirrored = np.vdot(expected_ways.conj(), measured_ways)
        measured_size = float(np.vdot(measured_ways, measured_ways).real)
        size = float(np.sqrt(expected_size * measured_size))
        scale = float(np.sqrt(measured_size / expected_size))
        if scale > SCALE and abs(same) > SHARE * size:
            return f"wrong unit: the head moves {scale:.0f} times as far as expected; send metres"
        if abs(mirrored) > SHARE * size > abs(same) + 0.2 * size:
            return (
                "mirrored axes: the head moves to the other side than its joints say; send a "
                "right-handed frame, z up"
            )
        angle = float(np.angle(same))
        self.has_agreed |= bool(
            abs(same) > max(AGREED * size, abs(mirrored))
            and abs(angle) < TURNED_RAD
            and scale < SCALE
            and turned > LEAST_TURN_RAD2
            and _correlation(expected, measured) > AGREED
        )
        if abs(same) > SHARE * size and abs(angle) > TURNED_RAD:
            return (
                f"wrong frame: the head moves {np.degrees(angle):+.0f} degrees off the direction "
                "that it points to; correct pose.offset_deg or the source's axes"
            )
        return None


def _heading(measured: HeadMeasurement) -> float:
    return float(np.arctan2(measured.rotation[1, 0], measured.rotation[0, 0]))


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size else 0.0
