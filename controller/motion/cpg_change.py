"""How oscillators go from one pattern to another: the fastest way that stays within the limits."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from controller.gaits.cpg import Cpg, CpgState
from controller.gaits.cpg_pattern import Pattern
from controller.motion.source import Pace

Floats = NDArray[np.float64]

GAINS = np.geomspace(10.0, 0.5, 10)
"""Of amplitudes, 1/s, fastest first."""
LEAST_DIRECT = 1.5
"""Gains below this are for a change in two steps only."""
CLOCK_GAIN = 6.0
CRAWL = 0.2
"""Of the slower of two gaits: in a change in two steps amplitudes change at this frequency."""
TOLERANCE = 0.02
WIDER = 0.05
"""By which the limits are widened where no change stays within them; twice that the next time."""
SETTLE = 14.0
"""Times 1 / gain: how long a change is looked at; 0.7 % of it are left then."""
SAMPLE_S = 0.02
MOST_SAMPLES = 600


@dataclass(frozen=True, slots=True)
class Part:
    """A pattern to go to, and how fast."""

    pattern: Pattern
    gain: float
    """Of amplitudes, 1/s."""
    clock_gain: float
    """Of the frequency, 1/s."""

    @property
    def time_s(self) -> float:
        """Until it has settled."""
        return SETTLE / min(self.gain, self.clock_gain)

    def begin(self, cpg: Cpg) -> None:
        """Make it what the oscillators go to."""
        cpg.become(self.pattern, self.gain, self.clock_gain)


def quickest_change(cpg: Cpg, pattern: Pattern, limit: Pace) -> tuple[tuple[Part, ...], Pace]:
    """Choose the fastest change that stays within the limits: each is known in closed form.

    Where a wide slow gait becomes a narrow fast one, or back, amplitude times frequency would pass
    its limits on the way: then the oscillators slow down, change, and speed up again.

    Returns:
        the parts of the change, one after the other, and the largest speeds on the way.

    """
    start = cpg.now()
    slow = CRAWL * min(cpg.pattern.omega_rad_s or np.inf, pattern.omega_rad_s or np.inf)
    crawl = replace(pattern, omega_rad_s=slow if np.isfinite(slow) else 0.0)
    ways: list[tuple[Part, ...]] = [(Part(pattern, g, g),) for g in GAINS if g >= LEAST_DIRECT]
    ways += [(Part(crawl, g, CLOCK_GAIN), Part(pattern, g, CLOCK_GAIN)) for g in GAINS]
    enough, wider = 1.0 + TOLERANCE, WIDER
    while True:
        for way in ways:
            excess, pace = _judge(cpg, start, way, limit, enough)
            if excess <= enough:
                cpg.restore(start)
                return way, pace
        enough, wider = enough * (1.0 + wider), 2.0 * wider


def _judge(
    cpg: Cpg, start: CpgState, way: tuple[Part, ...], limit: Pace, enough: float
) -> tuple[float, Pace]:
    """Largest share of a limit, and largest values; no more is looked at once it is ``enough``."""
    cpg.restore(start)
    over, fast, hard = 0.0, np.zeros(cpg.joints), np.zeros(cpg.joints)
    for part in way:
        step_s = max(SAMPLE_S, part.time_s / MOST_SAMPLES)
        part.begin(cpg)
        times_s = np.arange(0.0, part.time_s, step_s)
        one, speed, change = cpg.judge(
            times_s, limit.speed_rad_s, limit.acceleration_rad_s2, enough
        )
        over = max(over, one)
        fast, hard = np.maximum(fast, speed), np.maximum(hard, change)
        if over > enough:
            break
        cpg.skip(part.time_s)
    return over, Pace(fast, hard)
