"""A fish that swims by a script: glides, tail beats and turns, every angle known."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.animals.fish.model import fish_model
from snakewalk.controller.animals.fish.postures import Postures
from snakewalk.controller.kinematics.smoothstep import cubic


@dataclass(frozen=True, slots=True)
class Stroke:
    """One piece of a script."""

    kind: Literal["glide", "beat", "turn"]
    seconds: float
    turn_rad: float = 0.0
    """Change of heading; positive to the left."""
    bend_rad: float = 0.45
    """Largest spine angle, at the tail."""


SCRIPT = (
    Stroke("glide", 0.4),
    Stroke("beat", 0.8),
    Stroke("glide", 0.3),
    Stroke("turn", 0.6, 0.9),
    Stroke("beat", 0.8, 0.1),
    Stroke("glide", 0.4),
    Stroke("turn", 0.6, -1.1),
    Stroke("beat", 0.8, -0.05),
    Stroke("turn", 0.5, -0.6),
    Stroke("beat", 0.8),
    Stroke("glide", 0.5),
    Stroke("turn", 0.7, 1.3),
    Stroke("beat", 1.2),
    Stroke("glide", 0.6),
)
"""Nine seconds: turns to both sides, beats slow and fast, glides."""


def swim(
    script: tuple[Stroke, ...] = SCRIPT, rate_hz: float = 30.0, build: str = "carp"
) -> Postures:
    """Swim a script, body lengths as unit: a carp's spine angles, heading, place, height and pitch.

    A beat runs down the body, larger towards the tail, and begins and ends straight. A turn bends
    the body to one side, head first. Speed rises in beats and falls in glides.
    """
    joints_at = fish_model(build).joints_at
    share = np.linspace(0.0, 1.0, len(joints_at))
    head = [0.0]
    angles = [np.zeros(len(joints_at))]
    speed = [0.8]
    for stroke in script:
        count = round(stroke.seconds * rate_hz)
        start = head[-1]
        for k in range(1, count + 1):
            u = k / count
            bend, turned = _shape(stroke, u, share)
            angles.append(bend)
            head.append(start + turned)
            gain = {"glide": 0.0, "beat": 1.6, "turn": 0.8}[stroke.kind]
            speed.append(speed[-1] + (gain - 0.9 * speed[-1]) / rate_hz)
    heading = np.array(head)
    pace = np.array(speed) / rate_hz
    step = np.column_stack([np.cos(heading), np.sin(heading)]) * pace[:, None]
    base = np.cumsum(step, axis=0) - step[0]
    time = np.arange(len(heading)) / rate_hz
    return Postures(
        base=base - 0.5 * (base.min(axis=0) + base.max(axis=0)),
        head_rad=heading,
        angles_rad=np.stack(angles),
        joints_at=joints_at,
        rate_hz=rate_hz,
        height=0.25 * np.sin(0.9 * time),
        pitch_rad=0.2 * np.cos(0.9 * time),
        name="scripted fish",
        source="made by a script",
        licence="none needed",
    )


def _shape(stroke: Stroke, u: float, share: Floats) -> tuple[Floats, float]:
    """Spine angles (J,) and heading turned so far, at share ``u`` of a stroke."""
    smooth = cubic(u)
    if stroke.kind == "glide":
        return np.zeros(len(share)), stroke.turn_rad * smooth
    late = np.clip(u * 1.25 - 0.25 * share, 0.0, 1.0)
    window = np.sin(np.pi * late) ** 2
    if stroke.kind == "turn":
        side = np.sign(stroke.turn_rad)
        return side * stroke.bend_rad * (1.0 - 0.4 * share) * window, stroke.turn_rad * smooth
    beats = max(1, round(stroke.seconds / 0.4))
    wave = np.sin(2.0 * np.pi * beats * late)
    recoil = -0.12 * stroke.bend_rad * float(np.sin(2.0 * np.pi * beats * u) * np.sin(np.pi * u))
    return stroke.bend_rad * (0.4 + 0.6 * share) * wave * np.sqrt(window), (
        stroke.turn_rad * smooth + recoil
    )
