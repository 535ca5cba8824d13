"""A film of a fish whose every angle is known: frames, empty scenes and the truth in one folder."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.animals.fish.film_options import FishFilmOptions
from snakewalk.controller.animals.fish.model import FishModel, fish_model
from snakewalk.controller.animals.fish.postures import Postures, postures_of_track, save_postures
from snakewalk.controller.animals.fish.rendered_fish import FishScene
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.kinematics.smoothstep import cubic
from snakewalk.controller.track.readers.load import load_track


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


def render(
    folder: Path,
    options: FishFilmOptions,
    *,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Postures:
    """Write ``top/``, ``top-background.png``, with ``side`` the same from the side, ``truth.npz``.

    Args:
        folder: made if it is not there.
        options: motion, body and views; a recording of midlines has no height and swims level.
        on_progress: called with the frames done, and in all.

    Returns:
        The truth, body lengths as unit; (0, 0) is the middle of the frame.

    """
    length_px = options.length_px
    truth, spine, height = _truth(options.motion, options.build, options.frames)
    low, high = np.nanmin(spine, axis=(0, 1)), np.nanmax(spine, axis=(0, 1))
    columns, rows = (int(np.ceil((high - low)[k] * length_px + 0.6 * length_px)) for k in (0, 1))
    shift = np.array([columns, -rows]) / 2.0 - 0.5 * (low + high) * length_px
    model = fish_model(options.build, length_px)
    half_width = model.half_width * length_px
    top = FishScene(rows, columns, options.seed)
    (folder / "top").mkdir(parents=True, exist_ok=True)
    _write(folder / "top-background.png", top.background())
    side_rows = round(2.2 * length_px)
    side_scene = FishScene(side_rows, columns, options.seed + 1)
    if options.side:
        (folder / "side").mkdir(exist_ok=True)
        _write(folder / "side-background.png", side_scene.background())
    for k, body in enumerate(spine):
        body_px = body * length_px + shift
        picture = top.top(body_px, half_width, options.fins * length_px)
        _write(folder / "top" / f"{k:05d}.png", picture)
        if options.side:
            height_px = height[k] * length_px - 0.5 * side_rows
            _write(
                folder / "side" / f"{k:05d}.png",
                _side_view(side_scene, model, body, body_px[:, 0], height_px),
            )
        on_progress(k + 1, len(spine))
    with atomic_write(folder / "truth.npz") as part:
        save_postures(part, truth)
    return truth


def _side_view(
    scene: FishScene, model: FishModel, body: Floats, x_px: Floats, height_px: Floats
) -> Image:
    """(H, W) the fish from the side.

    Args:
        scene: the side camera.
        model: sections of the fish.
        body: (P, 2) midline from above, body lengths: its direction says how wide sections look.
        x_px: (P,) where it is along the view.
        height_px: (P,) its heights, up.

    """
    step = np.gradient(body, axis=0)
    across = np.abs(step[:, 1]) / np.maximum(np.hypot(step[:, 0], step[:, 1]), 1e-9)
    place = np.linspace(0.0, 1.0, len(body))
    stations = np.linspace(0.0, 1.0, len(model.half_width))
    wide_px = np.interp(place, stations, model.half_width * model.length_px) * across
    high_px = np.interp(place, stations, model.half_height * model.length_px)
    return scene.side(np.column_stack([x_px, height_px]), wide_px, high_px)


def _truth(motion: str | None, build: str, frames: int | None) -> tuple[Postures, Floats, Floats]:
    """Postures, spines (T, P, 2) and heights (T, P), all in body lengths."""
    model = fish_model(build)
    if motion is not None:
        track = load_track(motion)
        all_postures = postures_of_track(track, model.joints_at)
        is_matched = all_postures.found
        unit = all_postures.length
        truth = replace(
            all_postures,
            base=all_postures.base[is_matched][:frames] / unit,
            head_rad=all_postures.head_rad[is_matched][:frames],
            angles_rad=all_postures.angles_rad[is_matched][:frames],
            length_m=None,
        )
        spine = track.points[:frames] / unit
        return truth, spine, np.zeros(spine.shape[:2])
    all_postures = swim(build=build)
    truth = replace(
        all_postures,
        base=all_postures.base[:frames],
        head_rad=all_postures.head_rad[:frames],
        angles_rad=all_postures.angles_rad[:frames],
        height=None if all_postures.height is None else all_postures.height[:frames],
        pitch_rad=None if all_postures.pitch_rad is None else all_postures.pitch_rad[:frames],
    )
    zero = np.zeros(truth.frames)
    height = zero if truth.height is None else truth.height
    pitch = zero if truth.pitch_rad is None else truth.pitch_rad
    solid = np.stack(
        [
            model.midline(
                np.array([*truth.base[k], height[k]]), head, truth.angles_rad[k], pitch[k]
            )
            for k, head in enumerate(truth.head_rad)
        ]
    )
    return truth, solid[..., :2], solid[..., 2]


def _write(file: Path, image: Image) -> None:
    """Write a picture completely, or not at all.

    Raises:
        OSError: OpenCV cannot write it.

    """
    with atomic_write(file) as part:
        if not cv2.imwrite(str(part), image):
            raise OSError(5, "cannot write the picture", str(file))
