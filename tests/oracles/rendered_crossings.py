"""Films of several animals that cross and touch, with known midlines.

Each animal crawls on a wave along a smooth random path about the middle of the picture, so that
animals meet often.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.track.resample import equal_arc_length
from tests.oracles.rendered_snake import SnakeScene, coverage, shot_of_ground


@dataclass(frozen=True, slots=True)
class CrossingScene:
    """A dish with animals."""

    animals: int = 3
    rows: int = 260
    columns: int = 320
    frames: int = 150
    rate_hz: float = 15.0
    length_px: float = 60.0
    slender: float = 12.0
    speed: float = 0.45
    """Body lengths a second."""
    waves: float = 1.2
    bend_rad: float = 0.7
    sizes: float = 0.15
    """Lengths differ by up to this share from the mean."""
    greys: float = 25.0
    """Grey values differ by up to this from the mean."""
    body: float = 70.0
    ground: float = 170.0
    noise: float = 3.0
    roam: float = 0.28
    """Radius within which animals turn back to the middle, of the smaller side."""
    seed: int = 0


def crossing_midlines(scene: CrossingScene) -> Floats:
    """(A, T, 101, 2) x, y px, head first: each body follows the path of its head."""
    rng = np.random.default_rng([scene.seed, 11])
    middle = np.array([(scene.columns - 1) / 2.0, (scene.rows - 1) / 2.0])
    roam = scene.roam * min(scene.rows, scene.columns)
    out = []
    for number in range(scene.animals):
        length = lengths(scene)[number]
        step = length / 100.0
        travelled = scene.speed * scene.frames / scene.rate_hz * scene.length_px
        steps = int(np.ceil(travelled / step)) + 101
        angle = 2.0 * np.pi * (number + rng.uniform(0.0, 0.6)) / scene.animals
        place = middle + 1.3 * roam * np.array([np.cos(angle), np.sin(angle)])
        heading = angle + np.pi + rng.normal(0.0, 0.3)
        turn, path = 0.0, np.empty((steps, 2))
        phase = rng.uniform(0.0, 2.0 * np.pi)
        for k in range(steps):
            away = middle - place
            home = np.arctan2(away[1], away[0]) - heading
            home = np.arctan2(np.sin(home), np.cos(home))
            pull = home if np.hypot(*away) > roam else 0.0
            turn = 0.98 * turn + 0.0015 * rng.normal()
            heading += turn + 0.012 * pull
            wave = scene.bend_rad * np.sin(phase + 2.0 * np.pi * scene.waves * k / 100.0)
            place = place + step * np.array([np.cos(heading + wave), np.sin(heading + wave)])
            path[k] = place
        along = np.arange(scene.frames) / scene.rate_hz * scene.speed * scene.length_px / step
        s = np.arange(100, -1, -1)
        at = along[:, None] + s[None, :]
        body = np.stack([np.interp(at, np.arange(steps), path[:, c]) for c in (0, 1)], axis=-1)
        out.append(np.stack([equal_arc_length(one, 100) for one in body]))
    return np.stack(out)


def lengths(scene: CrossingScene) -> Floats:
    """(A,) px."""
    rng = np.random.default_rng([scene.seed, 12])
    return np.asarray(scene.length_px * (1.0 + scene.sizes * rng.uniform(-1.0, 1.0, scene.animals)))


def crossing_film(scene: CrossingScene, midlines: Floats) -> Iterator[Image]:
    """The frames (H, W) of midlines (A, T, 101, 2)."""
    rng = np.random.default_rng([scene.seed, 13])
    greys = scene.body + scene.greys * rng.uniform(-1.0, 1.0, scene.animals)
    side = int(np.ceil(1.1 * scene.length_px * (1.0 + scene.sizes))) + 24
    bodies = [
        SnakeScene(length_px=float(one), rows=side, columns=side, slender=scene.slender)
        for one in lengths(scene)
    ]
    whole = SnakeScene(rows=scene.rows, columns=scene.columns, noise=scene.noise)
    for lines in midlines.transpose(1, 0, 2, 3):
        picture = np.full((scene.rows + 2 * side, scene.columns + 2 * side), scene.ground)
        for line, body, grey in zip(lines, bodies, greys, strict=True):
            corner = np.floor(line.mean(axis=0) - 0.5 * side).astype(int)
            cover = coverage(body, line - corner)
            x, y = corner + side
            part = picture[y : y + side, x : x + side]
            part += (grey - part) * cover
        inner = picture[side:-side, side:-side].astype(np.float32)
        yield shot_of_ground(whole, inner, rng)
