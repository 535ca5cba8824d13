"""The animal's motion in numbers: wave, pulse speed, sliding, amplitudes, energy in the state."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.reading import texts
from snakewalk.controller.shape.states import StateRange, energy_kept, state_range, to_states
from snakewalk.controller.track.pulse_speed import NEIGHBOURS, PulseSpeed, measure_pulse_speed
from snakewalk.controller.track.track import Track
from snakewalk.controller.track.undulation import (
    Advance,
    Undulation,
    advance_of,
    even_points,
    measure_undulation,
)
from snakewalk.controller.track.wave import Wave, below, measure_wave

TARGET_SHIFT = 4.0
"""Points that the pattern should move between the frames that are compared."""
COEFFICIENTS = 7
LEAST_TRAVEL = 0.2
"""Share of the pulse speed: recorded animals that go somewhere lie at 0.7 or more."""
_SLIPS = "w_d below 0: the body slips; the wave runs back faster than the head advances"


@dataclass(frozen=True, slots=True)
class Analysis:
    """The results of ``snakewalk animal analyse``."""

    track: Track
    wave: Wave
    pulse: PulseSpeed
    undulation: Undulation
    advance: Advance | None
    """Speed of each segment at ``pulse.frame``; None where the recording does not hold places."""
    energy: Floats
    """(T,) share of each shape's energy in seven coefficients, [PT] 2.5."""
    states: StateRange
    """Range of the random states that are drawn for the graph, [PT] Eq. 1."""

    @property
    def pulse_body_lengths_s(self) -> float:
        """Median pulse speed."""
        return float(self.pulse.typical * self.track.rate_hz / self.track.angles_rad.shape[1])

    @property
    def pulse_unknown_reason(self) -> str | None:
        """Reason why pulse speed and all values divided by it are unknown, or None."""
        if self.wave.coarse:
            return self.wave.unknown_reason
        if not np.isfinite(self.pulse.points_per_frame).any():
            return "no part of the body shows how far the pattern moved"
        return None

    @property
    def travel_unknown_reason(self) -> str | None:
        """Reason why travel and sliding are unknown, or None."""
        if self.advance is None:
            return "places are not recorded"
        if self.pulse_unknown_reason is not None:
            return self.pulse_unknown_reason
        travel = self._over_pulse(self.advance.along)
        if travel is None:
            return "the pattern does not move along the body"
        if travel < LEAST_TRAVEL:
            return (
                f"over the ground the body goes at {below(travel, LEAST_TRAVEL, 2)} of the pulse "
                "speed: it holds station in a flow, drifts, or bends on the spot"
            )
        return None

    @property
    def travel(self) -> float | None:
        """Speed of the points along the body over the pulse speed; None if unknown.

        1: every point follows the head's path. A much smaller value may be a current against the
        animal: the ground does not show how the body slides.
        """
        if self.advance is None or self.travel_unknown_reason is not None:
            return None
        return self._over_pulse(self.advance.along)

    @property
    def sliding(self) -> float | None:
        """w_d of [PT] 2.6.4 as the synthesis uses it: the share of the head's speed not shifted.

        0: no sliding. Up to 1: the body glides in its shape. Below 0: the head advances less than
        the wave runs back.
        """
        if self.advance is None or self.travel_unknown_reason is not None:
            return None
        ratio = self._over_pulse(self.advance.head_speed(self.pulse.points_per_frame))
        return None if ratio is None or abs(ratio) < 1e-3 else 1.0 - 1.0 / ratio

    @property
    def slope_rad(self) -> Floats:
        """``abs(Theta_n(n, t))`` of the frames of ``pulse``, (S, N) rad a point."""
        return np.abs(np.gradient(self.track.angles_rad[self.pulse.frame], axis=1))

    @property
    def error_slope(self) -> tuple[float, float] | None:
        """How the error of one pulse speed for the whole body follows ``abs(Theta_n)``.

        [PT] 2.4 calls the absolute error proportional to it (Fig. 5(a)). Slope through the origin,
        points, and correlation, over all frames and points.
        """
        error = np.abs(self.pulse.body_error_rad)
        slope = self.slope_rad
        is_finite = np.isfinite(error)
        if is_finite.sum() < 3 or min(np.ptp(error[is_finite]), np.ptp(slope[is_finite])) < 1e-12:
            return None
        points = float((error[is_finite] * slope[is_finite]).sum() / (slope[is_finite] ** 2).sum())
        return points, float(np.corrcoef(error[is_finite], slope[is_finite])[0, 1])

    def _over_pulse(self, speed: Floats) -> float | None:
        """Ratio of a speed (S, N) to the pulse speed, weighted by squared slope."""
        both = np.isfinite(self.pulse.points_per_frame)
        weight = self.pulse.slope[both] ** 2
        moved = float((weight * self.pulse.points_per_frame[both]).sum())
        return None if abs(moved) < 1e-9 else float((weight * speed[both]).sum()) / moved

    def facts(self) -> dict[str, Any]:
        """Plain numbers for the table and JSON; None if ``*_not_told`` has a reason."""
        track = self.track
        wave = self.wave
        pulse = self.pulse
        u = pulse.points_per_frame
        is_known = np.isfinite(u)
        scale = track.rate_hz / track.angles_rad.shape[1]
        angle = self.undulation.angle_rad
        lateral = self.undulation.lateral
        point_indices = [0, 25, 50, 75, 99]
        no_wave, no_pulse = wave.unknown_reason, self.pulse_unknown_reason
        points, correlation = self.error_slope or (None, None)
        rms = np.sqrt(np.nanmean(pulse.body_error_rad**2)) if is_known.any() else np.nan

        def of_wave(value: float) -> float | None:
            return None if no_wave else round(value, 3)

        def of_pulse(value: float | None, digits: int) -> float | None:
            return None if no_pulse else _number(value, digits)

        return {
            "recording": track.name,
            "frames": track.frames,
            "frames_left_out": track.dropped,
            "frames_missing": track.absent,
            "frames_bridged": track.bridged,
            "every_nth_frame": track.every,
            "rate_hz": round(track.rate_hz, 3),
            "rate_assumed": track.rate_assumed,
            "times_uneven": track.uneven,
            "facts": texts(track.facts),
            "notes": [*track.notes, *([_SLIPS] if (self.sliding or 0.0) < 0.0 else [])],
            "length_m": None if track.length_m is None else round(track.length_m, 6),
            "frequency_hz": of_wave(wave.frequency_hz),
            "waves_on_body": of_wave(wave.waves),
            "wavelength_body_lengths": of_wave(1.0 / max(wave.waves, 1e-9)),
            "wave_number_rad_per_body_length": of_wave(2.0 * np.pi * wave.waves),
            "wave_towards_tail": None if no_wave else wave.towards_tail,
            "wave_share": round(wave.share, 3),
            "wave_not_told": no_wave,
            "time_towards_head": of_wave(wave.headward),
            "pulse_body_lengths_s": of_pulse(self.pulse_body_lengths_s, 4),
            "pulse_quartiles_body_lengths_s": None
            if no_pulse
            else [round(float(q) * scale, 4) for q in np.percentile(u[is_known], [25.0, 75.0])],
            "pulse_points_per_frame": of_pulse(pulse.typical, 3),
            "pulse_not_told": no_pulse,
            "pulse_frames_compared": pulse.step,
            "pulse_measured_share": round(float(is_known.mean()), 3),
            "wave_speed_body_lengths_s": None if no_wave else round(wave.pulse_body_lengths_s, 4),
            "one_pulse_error_rad": of_pulse(float(rms), 4),
            "one_pulse_error_over_slope_points": of_pulse(points, 3),
            "one_pulse_error_correlation": of_pulse(correlation, 3),
            "travel": _number(self.travel, 3),
            "sliding_weight": _number(self.sliding, 3),
            "travel_not_told": self.travel_unknown_reason,
            "angle_amplitude_rad": [round(float(angle[k]), 3) for k in point_indices],
            "lateral_amplitude_body_lengths": [
                round(float(lateral[k]), 4) for k in [*point_indices[:4], -1]
            ],
            "bend_k_rad": round(float(np.median(track.bend_rad)), 3),
            "energy_kept": round(float(self.energy.mean()), 5),
            "energy_kept_least": round(float(self.energy.min()), 5),
            "state_amplitudes_rad": np.round(self.states.amplitude_rad(), 3).tolist(),
        }


def analyse(track: Track) -> Analysis:
    """Measure a recording.

    Raises:
        InputError: nothing moves, or too few consecutive frames.

    """
    if track.frames < 4:
        raise InputError(f"{track.name}: an analysis needs 4 or more frames, not {track.frames}")
    if np.ptp(track.angles_rad, axis=0).max() < 1e-6:
        raise InputError(f"{track.name}: no motion: the shape is the same in all frames")
    wave = measure_wave(track)
    number = np.rint(track.time_s * track.rate_hz).astype(np.int64)
    segments = track.angles_rad.shape[1]
    expected = abs(wave.pulse_body_lengths_s) * segments / track.rate_hz
    step = int(np.clip(round(TARGET_SHIFT / max(expected, 1e-9)), 1, max(1, track.frames // 8)))
    half = int(0.45 * segments / max(wave.waves, 0.5))
    room = (segments - NEIGHBOURS) // 3
    most = max(2, min(max(12, int(np.ceil(2.0 * expected * step))), half, room))
    body = even_points(track)
    pulse = measure_pulse_speed(
        track.angles_rad, number, step, most, heading_known=body is not None
    )
    if len(pulse.frame) == 0:
        raise InputError(f"{track.name}: too few frames follow each other to compare them")
    return Analysis(
        track=track,
        wave=wave,
        pulse=pulse,
        undulation=measure_undulation(track, wave.frequency_hz),
        advance=None if body is None else advance_of(body, number, step),
        energy=energy_kept(track.angles_rad, COEFFICIENTS),
        states=state_range(to_states(track.angles_rad, COEFFICIENTS)),
    )


def _number(value: float | None, digits: int) -> float | None:
    return None if value is None or not np.isfinite(value) else round(value, digits)
