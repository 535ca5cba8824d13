"""Films of a snake whose midline is known: to measure the eyes with, and to try them without one.

A body bends in a travelling wave and swims in a circle; it is drawn finely, then lit, shadowed,
blurred and made noisy as a camera would.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.special import erf

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.track.resample import body_points, equal_arc_length

_STAIN = 0.05  # of the picture's width: how soft a blot is
_FINE = 8  # parts of a pixel's side in which bodies up to 100 px are drawn


@dataclass(frozen=True, slots=True)
class SnakeScene:
    """What is filmed, and how; grey values 0 to 255."""

    length_px: float = 150.0
    rows: int = 480
    columns: int = 640
    slender: float = 14.0
    """Length over greatest width."""
    waves: float = 1.3
    bend_rad: float = 0.9
    """Amplitude of the tangent angle."""
    frames: int = 120
    rate_hz: float = 30.0
    wave_hz: float = 0.8
    ground: float = 170.0
    body: float = 60.0
    noise: float = 3.0
    """Standard deviation of every pixel in every frame."""
    blur_px: float = 0.8
    light: float = 0.0
    """How much brighter the light is in one corner than in the middle, of its strength."""
    shadow: float = 0.0
    """How much light the body's shadow takes away."""
    taper: float = 0.45
    """Part of the body over which the tail tapers."""
    texture: float = 0.0
    """Standard deviation of the pattern of the ground."""
    seed: int = 0
    vignette: float = 0.0
    """How much light the lens takes away in the corners."""
    stains: float = 0.0
    """Contrast of blots on the ground, grey values; wide and soft ones."""
    jpeg: int = 0
    """Quality of a JPEG that each frame went through; 0: none."""
    follow: float = 0.0
    """How far the camera goes with the animal: 1 keeps its middle in the middle of the picture."""
    gain: float = 1.0
    """Exposure: above 1 the ground saturates."""
    tip: float = 0.15
    """Width of the tail's tip over the greatest width; 0: pointed."""
    head: float = 1.0
    """Width of the first sixth of the body over that of the rest; above 1: a wide head."""
    faint: float = 1.0
    """Contrast of the tail over that of the head; the change is at a third of the body."""
    bands: int = 0
    """Number of light bands across the body."""
    band: float = 0.25
    """Contrast of a light band over that of the body."""


def camera_places(scene: SnakeScene, midlines: Floats) -> Floats:
    """(T, 2) whole x, y of the picture's first pixel on the ground: the camera's motion."""
    middle = midlines.mean(axis=1) - [(scene.columns - 1) / 2.0, (scene.rows - 1) / 2.0]
    return np.asarray(np.rint(scene.follow * middle))


def true_midlines(scene: SnakeScene) -> Floats:
    """(T, 101, 2) x, y in pixels, head first, equal arcs; a pixel's centre is whole."""
    s = (np.arange(400) + 0.5) / 400
    time_s = np.arange(scene.frames) / scene.rate_hz
    pulse = scene.wave_hz / scene.waves  # body lengths a second
    around = min(scene.rows, scene.columns) / 2.0 - 0.3 * scene.length_px - 8.0
    # the middle of the body runs round the image's centre, the body along that circle
    radius = max(around, 0.3 * scene.length_px)
    turn = 0.8 * pulse * scene.length_px / radius
    tau = time_s[:, None] - s / pulse
    angles = scene.bend_rad * np.sin(2.0 * np.pi * scene.wave_hz * tau) - turn * tau
    body = body_points(angles, scene.length_px)
    body = body - body.mean(axis=1, keepdims=True)
    at = 0.5 * np.pi - turn * (time_s - 0.5 / pulse)
    centre = radius * np.stack([np.cos(at), np.sin(at)], axis=1)
    body = body + centre[:, None] + [(scene.columns - 1) / 2.0, (scene.rows - 1) / 2.0]
    body = body - camera_places(scene, body)[:, None]
    return np.stack([equal_arc_length(one, 100) for one in body])


def coiled_midlines(scene: SnakeScene) -> Floats:
    """(T, 101, 2) as ``true_midlines``, of a body that crawls, coils in the middle, and goes on.

    A bend goes from the head to the tail. By the seed it is a loop (280 to 520 degrees: the body
    crosses itself), or a hairpin (about 190 degrees, narrow: one half lies beside the other).
    """
    rng = np.random.default_rng([scene.seed, 7])
    if rng.uniform() < 0.3:
        turn, wide = np.radians(rng.uniform(180.0, 215.0)), rng.uniform(0.05, 0.08)
    else:
        turn = np.radians(rng.uniform(280.0, 520.0))
        wide = rng.uniform(0.1, 0.16) * max(1.0, turn / 5.0)
    turn *= rng.choice([-1.0, 1.0])
    first, last = rng.uniform(0.25, 0.4), rng.uniform(0.5, 0.7)
    s = (np.arange(400) + 0.5) / 400
    at = np.arange(scene.frames)[:, None] / scene.frames
    phase = scene.wave_hz * scene.frames / scene.rate_hz * at - scene.waves * s
    wave = scene.bend_rad * np.sin(2.0 * np.pi * (phase + rng.uniform()))
    place = first + (last - first) * at
    rise = np.sin(np.pi * np.clip((at - 0.15) / 0.7, 0.0, 1.0)) ** 2
    coil = 0.5 * turn * rise * erf((s - place) / (np.sqrt(2.0) * wide))
    drift = rng.uniform(-0.6, 0.6) * at + rng.uniform(0.0, 2.0 * np.pi)
    angles = wave * (1.0 - 0.6 * rise) + coil + drift
    body = body_points(angles, scene.length_px)
    travel = scene.length_px * (at - 0.5) * rng.uniform(-0.3, 0.3, 2)
    middle = np.array([(scene.columns - 1) / 2.0, (scene.rows - 1) / 2.0])
    body = body - body.mean(axis=1, keepdims=True) + travel[:, None] + middle
    return np.stack([equal_arc_length(one, 100) for one in body])


def film(scene: SnakeScene, midlines: Floats | None = None) -> Iterator[Image]:
    """The frames (H, W); of ``midlines`` (T, 101, 2) in a picture at rest if given."""
    rng = np.random.default_rng(scene.seed)
    ground = _ground(scene, rng)
    if midlines is not None:
        for midline in midlines:
            yield _shot(scene, ground, coverage(scene, midline), rng)
        return
    still = true_midlines(replace(scene, follow=0.0))
    for midline, (x, y) in zip(
        true_midlines(scene), camera_places(scene, still).astype(int), strict=True
    ):
        yield _shot(scene, np.roll(ground, (-y, -x), axis=(0, 1)), coverage(scene, midline), rng)


def empty(scene: SnakeScene) -> Image:
    """(H, W) the same place without the animal."""
    rng = np.random.default_rng(scene.seed)
    ground = _ground(scene, rng)
    return _shot(scene, ground, np.zeros_like(ground), np.random.default_rng(scene.seed + 1))


def half_width(scene: SnakeScene) -> Floats:
    """(101,) px along the body: a rounded head, thickest at two fifths, a tail that tapers."""
    s = np.linspace(0.0, 1.0, 101)
    shape = np.sqrt(np.clip(s / 0.08, 0.0, 1.0)) * (
        0.8 + 0.2 * np.sin(np.pi * np.minimum(s / 0.8, 1.0))
    )
    tail = np.clip((1.0 - s) / scene.taper, 0.0, 1.0) ** 0.8
    wide = np.minimum(shape, scene.tip + (1.0 - scene.tip) * tail)
    wide = wide * (1.0 + (scene.head - 1.0) * np.clip((0.22 - s) / 0.06, 0.0, 1.0))
    return np.asarray(0.5 * scene.length_px / scene.slender * wide)


def strength(scene: SnakeScene) -> Floats:
    """(100,) contrast of each piece of the body over the greatest: its bands, its faint tail."""
    s = (np.arange(100) + 0.5) / 100.0
    faint = 1.0 + (scene.faint - 1.0) * np.clip((s - 0.3) / 0.06, 0.0, 1.0)
    light = (np.sin(2.0 * np.pi * scene.bands * s) < 0.0) if scene.bands else np.zeros(100, bool)
    return np.asarray(faint * np.where(light, scene.band, 1.0))


def coverage(scene: SnakeScene, midline: Floats) -> NDArray[np.float32]:
    """(H, W) part of each pixel that the body covers."""
    fine = _FINE if scene.length_px <= 100.0 else 3
    side = np.gradient(midline, axis=0)
    normal = np.stack([-side[:, 1], side[:, 0]], axis=1) / np.hypot(*side.T)[:, None]
    wide = half_width(scene)[:, None]
    reach = float(wide.max()) + 3.0
    low = np.floor(midline.min(axis=0) - reach)
    size = np.ceil(midline.max(axis=0) + reach - low).astype(int)
    canvas = np.zeros((size[1] * fine, size[0] * fine), dtype=np.uint8)
    left, right = midline + wide * normal, midline - wide * normal
    grey = np.rint(255.0 * strength(scene))
    for k in range(len(midline) - 1):
        piece = np.stack([left[k], left[k + 1], right[k + 1], right[k]])
        corners = ((piece - low + 0.5) * fine - 0.5) * 256.0
        cv2.fillConvexPoly(canvas, np.rint(corners).astype(np.int32), grey[k], shift=8)
    cv2.circle(
        canvas,
        tuple(int(v) for v in np.rint(((midline[-1] - low + 0.5) * fine - 0.5) * 256.0)),
        round(float(wide[-1, 0]) * fine * 256.0),
        grey[-1],
        -1,
        shift=8,
    )
    shrunk = cv2.resize(canvas, (int(size[0]), int(size[1])), interpolation=cv2.INTER_AREA)
    whole = np.zeros((scene.rows, scene.columns), dtype=np.float32)
    x, y = int(low[0]), int(low[1])
    rows = slice(max(0, y), min(scene.rows, y + int(size[1])))
    columns = slice(max(0, x), min(scene.columns, x + int(size[0])))
    part = shrunk[rows.start - y : rows.stop - y, columns.start - x : columns.stop - x]
    whole[rows, columns] = part.astype(np.float32) / 255.0
    return whole


def _ground(scene: SnakeScene, rng: np.random.Generator) -> NDArray[np.float32]:
    ground = np.full((scene.rows, scene.columns), scene.ground, dtype=np.float32)
    if scene.texture > 0.0:
        pattern = np.asarray(
            cv2.GaussianBlur(rng.normal(size=ground.shape).astype(np.float32), (0, 0), 2.0)
        )
        ground += scene.texture * pattern / float(pattern.std())
    if scene.stains > 0.0:
        pattern = rng.normal(size=ground.shape).astype(np.float32)
        soft = gaussian_filter(pattern, _STAIN * scene.columns, mode="wrap")
        ground -= scene.stains * np.clip(soft / float(soft.std()) - 0.5, 0.0, 1.5)
    return ground


def shot_of_ground(
    scene: SnakeScene, ground: NDArray[np.float32], rng: np.random.Generator
) -> Image:
    """(H, W) the picture that a camera takes of a drawn scene without another body."""
    return _shot(scene, ground, np.zeros_like(ground), rng)


def _shot(
    scene: SnakeScene,
    ground: NDArray[np.float32],
    body: NDArray[np.float32],
    rng: np.random.Generator,
) -> Image:
    lit = ground
    if scene.shadow > 0.0:
        away = 0.5 * scene.length_px / scene.slender
        move = np.array([[1.0, 0.0, away], [0.0, 1.0, 0.7 * away]])
        shade = cv2.warpAffine(body, move, (scene.columns, scene.rows))
        lit = ground * (1.0 - scene.shadow * cv2.GaussianBlur(shade, (0, 0), 1.0 + 0.3 * away))
    image = lit * (1.0 - body) + scene.body * body
    if scene.light > 0.0:
        y, x = np.mgrid[0 : scene.rows, 0 : scene.columns]
        image = image * (1.0 + scene.light * (x / scene.columns + y / scene.rows - 1.0))
    if scene.vignette > 0.0:
        y, x = np.mgrid[0 : scene.rows, 0 : scene.columns]
        away = np.hypot(2.0 * x / scene.columns - 1.0, 2.0 * y / scene.rows - 1.0) / np.sqrt(2.0)
        image = image * (1.0 - scene.vignette * away**4)
    image = scene.gain * image
    if scene.blur_px > 0.0:
        image = cv2.GaussianBlur(image.astype(np.float32), (0, 0), scene.blur_px)
    noisy = image + scene.noise * rng.standard_normal(image.shape, dtype=np.float32)
    whole = np.asarray(np.clip(np.rint(noisy), 0, 255), dtype=np.uint8)
    if not scene.jpeg:
        return whole
    packed = cv2.imencode(".jpg", whole, [cv2.IMWRITE_JPEG_QUALITY, scene.jpeg])[1]
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)
