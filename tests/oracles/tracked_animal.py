"""An animal with legs as a tracker sees it from above: noise, missing points, missing frames."""

from pathlib import Path

import numpy as np

from snakewalk.config.animal import AnimalConfig
from snakewalk.config.arrays import Floats
from snakewalk.controller.animals.legged.motion_transformation import PathNormals
from snakewalk.controller.animals.legged.prototype import prototype
from snakewalk.controller.terrain.path import SplinePath

NOISE = 0.005
"""Of the body's length, standard deviation of a coordinate of a tracked point."""


def tracked(animal: AnimalConfig, cycles: float, frames: int, seed: int) -> tuple[Floats, Floats]:
    """Spine (T, 6, 2) and feet (T, 4, 2) on a bend, with noise; neck and hip are 1 and 3."""
    made = prototype(animal, np.arange(round(cycles * frames)) * animal.cycle_s / frames)
    front, hind = (pair.at for pair in animal.leg_pairs)
    along = np.linspace(0.0, 1.0, made.spine_m.shape[1])
    places = [0.0, front, 0.5 * (front + hind), hind, 0.5 * (hind + 1.0), 1.0]
    spine = np.stack(
        [[np.interp(places, along, axis) for axis in body.T] for body in made.spine_m]
    ).transpose(0, 2, 1)
    way = PathNormals(SplinePath(animal.length_m * np.array([[0, 0], [2, 0.4], [4, 2], [8, 4]])))
    rng = np.random.default_rng(seed)
    noise = NOISE * animal.length_m
    spine, feet = (way.bent(points)[..., :2] for points in (spine, made.foot_m))
    return spine + rng.normal(0.0, noise, spine.shape), feet + rng.normal(0.0, noise, feet.shape)


def table(file: Path, animal: AnimalConfig) -> None:
    """Write a SLEAP table in pixels, rows downwards, with frames and points missing."""
    spine, feet = tracked(animal, 7.0, 24, 5)
    names = ["nose", "neck", "mid", "hip", "tail", "tip", "FL", "FR", "HL", "HR"]
    pixels = 1000.0 * np.concatenate([spine, feet], axis=1)
    pixels[..., 1] = 800.0 - pixels[..., 1]
    rng = np.random.default_rng(1)
    lines = ["track,frame_idx," + ",".join(f"{name}.x,{name}.y" for name in names)]
    for frame, points in enumerate(pixels):
        seen = rng.random(len(points)) > 0.02
        cells = [f"{x:.2f},{y:.2f}" if s else "," for (x, y), s in zip(points, seen, strict=True)]
        if frame % 37 != 5:
            lines.append(f"a,{frame}," + ",".join(cells))
    file.write_text("\n".join(lines))
