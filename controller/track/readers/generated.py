"""Shipped recordings: tracks computed from figures of real animals (``config/recordings``).

The head's motion runs down the body at pulse speed, scaled by the envelope measured on the animal:
``theta(s, t) = a(s) g(tau) sin(phase(tau)) + heading(tau)``, ``tau = t - s / pulse``. The result is
deterministic.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.loader import load, locate, shipped
from snakewalk.config.recording import RecordingConfig
from snakewalk.controller.kinematics.smoothstep import cubic
from snakewalk.controller.track.resample import SEGMENTS, body_points
from snakewalk.controller.track.track import Track

EMBEDDED = shipped("recordings")
"""Names of the shipped recordings."""
_SAMPLES_PER_CYCLE = 64  # samples per cycle of the head's motion


def generate(figures: RecordingConfig) -> Track:
    """Make the track: 100 segments, the head travelling along its own tangent."""
    s = (np.arange(SEGMENTS) + 0.5) / SEGMENTS
    pulse = figures.frequency_hz / figures.waves  # body lengths per second
    seconds = sum(e.cycles for e in figures.episodes) / figures.frequency_hz
    time = np.arange(round(seconds * figures.rate_hz) + 1) / figures.rate_hz
    tau = time[:, None] - s / pulse
    knots_s, gain, phase, heading = _script(figures, -1.0 / pulse, seconds)
    stations = np.linspace(0.0, 1.0, len(figures.envelope_rad))
    swing = np.interp(s, stations, figures.envelope_rad) * np.interp(tau, knots_s, gain)
    angles = swing * np.sin(np.interp(tau, knots_s, phase)) + np.interp(tau, knots_s, heading)
    front = angles[:, 0]
    step = np.stack([np.cos(front), np.sin(front)], axis=-1)
    travel = np.cumsum(step, axis=0) * (figures.travel * pulse / figures.rate_hz)
    return Track(
        name=figures.name,
        angles_rad=np.asarray(angles),
        points=(body_points(angles) + travel[:, None, :]) * figures.length_m,
        time_s=time,
        rate_hz=figures.rate_hz,
        length_m=figures.length_m,
        dropped=0,
        source=figures.source,
        licence=figures.licence,
    )


def embedded(name: str) -> Track:
    """Make a shipped recording.

    Raises:
        ConfigError: the name is unknown.

    """
    return generate(load(locate("recordings", name), RecordingConfig))


def _script(
    figures: RecordingConfig, start_s: float, stop_s: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Time, gain, phase and heading of the head from ``start_s`` to ``stop_s``."""
    count = int((stop_s - start_s) * figures.frequency_hz * _SAMPLES_PER_CYCLE) + 2
    knots_s = np.linspace(start_s, stop_s, count)
    gain = np.full(count, figures.episodes[0].gain)
    waves = np.full(count, figures.episodes[0].waves or figures.waves)
    heading = np.zeros(count)
    begin_s = 0.0
    last_gain = float(gain[0])
    last_waves = float(waves[0])
    for episode in figures.episodes:
        span_s = episode.cycles / figures.frequency_hz
        u = np.clip((knots_s - begin_s) / span_s, 0.0, 1.0)
        ease = cubic(u)
        next_waves = episode.waves or figures.waves
        gain += (episode.gain - last_gain) * ease
        waves += (next_waves - last_waves) * ease
        heading += episode.turn_rad * ease
        begin_s = begin_s + span_s
        last_gain = episode.gain
        last_waves = next_waves
    rate = 2.0 * np.pi * figures.frequency_hz * waves / figures.waves
    phase = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(knots_s))])
    return knots_s, gain, phase, heading
