"""A film of a fish whose every angle is known: frames, empty scenes and the truth in one folder."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.app.result_files import atomic_write
from snakewalk.controller.capture.fish.model import fish_model
from snakewalk.controller.capture.fish.postures import Postures, postures_of_track, save_postures
from snakewalk.controller.capture.fish.raster import Grey
from snakewalk.controller.capture.fish.rendered_fish import FishScene
from snakewalk.controller.capture.fish.swimmer import swim
from snakewalk.controller.capture.readers.load import load_track


def render(
    folder: Path,
    *,
    motion: str | None = None,
    build: str = "carp",
    length_px: float = 120.0,
    frames: int | None = None,
    side: bool = False,
    seed: int = 0,
    tick: Callable[[int, int], None] = lambda done, total: None,
) -> Postures:
    """Write ``top/``, ``top-background.png``, with ``side`` the same from the side, ``truth.npz``.

    Args:
        folder: made if it is not there.
        motion: a recording to render; a scripted fish without one.
        build: carp or eel.
        length_px: body length.
        frames: at most so many.
        side: also film from the side; a recording of midlines has no height and swims level.
        seed: of patterns and noise.
        tick: told of frames done and in all.

    Returns:
        The truth, body lengths as unit; (0, 0) is the middle of the frame.

    """
    truth, spine, tall = _truth(motion, build, frames)
    low, high = np.nanmin(spine, axis=(0, 1)), np.nanmax(spine, axis=(0, 1))
    columns, rows = (int(np.ceil((high - low)[k] * length_px + 0.6 * length_px)) for k in (0, 1))
    shift = np.array([columns, -rows]) / 2.0 - 0.5 * (low + high) * length_px
    model = fish_model(build, length_px)
    half = model.half_width * length_px
    top = FishScene(rows, columns, seed)
    (folder / "top").mkdir(parents=True, exist_ok=True)
    _write(folder / "top-background.png", top.background())
    height = round(2.2 * length_px)
    beside = FishScene(height, columns, seed + 1)
    if side:
        (folder / "side").mkdir(exist_ok=True)
        _write(folder / "side-background.png", beside.background())
    at = np.linspace(0.0, 1.0, len(half))
    for k, body in enumerate(spine):
        flat = body * length_px + shift
        _write(folder / "top" / f"{k:05d}.png", top.top(flat, half))
        if side:
            rise = tall[k] * length_px - 0.5 * height
            seen = np.column_stack([flat[:, 0], rise])
            step = np.gradient(body, axis=0)
            across = np.abs(step[:, 1]) / np.maximum(np.hypot(step[:, 0], step[:, 1]), 1e-9)
            known = np.linspace(0.0, 1.0, len(flat))
            wide = np.interp(known, at, half) * across
            high_px = np.interp(known, at, model.half_height * length_px)
            _write(folder / "side" / f"{k:05d}.png", beside.side(seen, wide, high_px))
        tick(k + 1, len(spine))
    with atomic_write(folder / "truth.npz") as part:
        save_postures(part, truth)
    return truth


def _truth(motion: str | None, build: str, frames: int | None) -> tuple[Postures, Floats, Floats]:
    """Postures, spines (T, P, 2) and heights (T, P), all in body lengths."""
    if motion is not None:
        track = load_track(motion)
        whole = postures_of_track(track, fish_model(build).joints_at)
        known = whole.found
        unit = whole.length
        truth = Postures(
            base=whole.base[known][:frames] / unit,
            head_rad=whole.head_rad[known][:frames],
            angles_rad=whole.angles_rad[known][:frames],
            joints_at=whole.joints_at,
            rate_hz=whole.rate_hz,
            name=whole.name,
            source=whole.source,
            licence=whole.licence,
        )
        spine = track.points[:frames] / unit
        return truth, spine, np.zeros(spine.shape[:2])
    whole = swim(build=build)
    truth = Postures(
        base=whole.base[:frames],
        head_rad=whole.head_rad[:frames],
        angles_rad=whole.angles_rad[:frames],
        joints_at=whole.joints_at,
        rate_hz=whole.rate_hz,
        height=None if whole.height is None else whole.height[:frames],
        pitch_rad=None if whole.pitch_rad is None else whole.pitch_rad[:frames],
        name=whole.name,
        source=whole.source,
        licence=whole.licence,
    )
    model = fish_model(build)
    zero = np.zeros(truth.frames)
    tall = zero if truth.height is None else truth.height
    lifted = zero if truth.pitch_rad is None else truth.pitch_rad
    solid = np.stack(
        [
            model.midline(np.array([*truth.base[k], tall[k]]), head, truth.angles_rad[k], lifted[k])
            for k, head in enumerate(truth.head_rad)
        ]
    )
    return truth, solid[..., :2], solid[..., 2]


def _write(file: Path, image: Grey) -> None:
    if not cv2.imwrite(str(file), image):
        raise OSError(5, "cannot write the picture", str(file))
