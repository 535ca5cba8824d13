"""Embedded recordings: tracks made by formula from figures of real animals, each with its source.

``worm-like``: crawling *C. elegans*. Figures measured from the recording of Broekmans et al. 2016
(eLife 5:e17227, CC BY; joint angles as published with elegansbot, MIT): bends of the body of up to
1 rad a joint of 24, forward waves between 1 and 2 a body, and turns whose head bends by more
than a half circle. ``lamprey-like``: steadily swimming sea lamprey, wave of 0.57 body lengths at
3.85 Hz (measured from the recording of fishmechr, E. D. Tytell, CC BY 4.0), lateral movement
growing towards the tail.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from config.errors import InputError

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class AngleRecording:
    """Tangent angles over time."""

    name: str
    angles_rad: Floats
    """(T, 100), head first, unwrapped."""
    rate_hz: float


def _wave(
    waves: float, rate_hz: float, cycle_s: float, seconds: float, head: float, tail: float
) -> Floats:
    """Travelling wave of tangent angle, amplitude growing linearly from head to tail."""
    s = (np.arange(100) + 0.5) / 100
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    amplitude = head + (tail - head) * s
    return np.asarray(amplitude * np.sin(2 * np.pi * (t[:, None] / cycle_s - waves * s)))


def worm_like() -> AngleRecording:
    """Crawl with bends and turns, 32 Hz."""
    s = (np.arange(100) + 0.5) / 100
    angles = _wave(1.25, 32.0, 2.0, 12.0, 0.85, 0.65)
    time = np.arange(len(angles)) / 32.0
    # turns: a bend that is made at the head, travels down the body and leaves at the tail
    for at_s, size_rad in ((3.0, 1.2), (6.0, -1.2), (9.0, 0.8)):
        front = (time - at_s)[:, None] / 2.0 - s
        angles = angles + size_rad / (1.0 + np.exp(-front / 0.15)) - size_rad
    return AngleRecording("worm-like", angles, 32.0)


def lamprey_like() -> AngleRecording:
    """Steady swimming at 50 Hz, slow and fast bends, wave of 0.57 body lengths."""
    angles = _wave(1.0 / 0.57, 50.0, 1.0 / 3.85, 1.6, 0.25, 0.6)
    return AngleRecording("lamprey-like", angles, 50.0)


EMBEDDED = {"worm-like": worm_like, "lamprey-like": lamprey_like}


def embedded(name: str) -> AngleRecording:
    """Make an embedded recording by name.

    Raises:
        InputError: there is none of that name.

    """
    if name not in EMBEDDED:
        raise InputError(f"track {name!r}: no such recording; embedded are {', '.join(EMBEDDED)}")
    return EMBEDDED[name]()
