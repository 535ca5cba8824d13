"""Poses and ground of walk-throughs through drawn scenes, without a guess of any distance.

The ravine is drawn by rays, the yard by MuJoCo with photographs as textures. Steps are 0.75 to
0.95 m long, with turns. The seeds of the table are not those of the development (1 to 3).

python -m benchmarks.walkthrough_scenes --seeds 4 5 6 7 8
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

from benchmarks.provenance import provenance
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load
from snakewalk.config.walkthrough import WalkthroughConfig
from snakewalk.controller.mapping.mosaic.walk import StereoWalk, read_walk
from snakewalk.controller.mapping.mosaic.walk_ground import level_stand, walk_ground
from tests.oracles import ravine
from tests.oracles.textured_yard import Yard

SPACING_M = 0.02
ERROR_M = 0.03
LEVEL = 0.5
"""Slope up to which the ground is compared: above it a cell holds several heights."""


def write_scene(folder: Path, kind: str, seed: int) -> Path:
    """Write the pictures of four positions; return the positions' file."""
    if kind == "yard":
        yard = Yard(seed)
        stations = yard.stations(4)
        return ravine.write_positions(folder, yard, stations, yard.pairs(stations))
    rng = np.random.default_rng(seed)
    camera = ravine.Camera((420, 320), float(rng.uniform(320.0, 420.0)))
    steps_m = [float(rng.uniform(0.0, 2.0)), *rng.uniform(0.8, 0.92, 3)]
    turns_rad = rng.uniform(-0.087, 0.087, 4)
    stations = [
        ravine.station(float(x), float(turn))
        for x, turn in zip(np.cumsum(steps_m), turns_rad, strict=True)
    ]
    pairs = [camera.pair(at, number) for number, at in enumerate(stations)]
    return ravine.write_positions(folder, camera, stations, pairs)


def true_height(kind: str, seed: int, x_m: Floats, y_m: Floats) -> Floats:
    """Heights of the ground at places of any shape."""
    if kind == "yard":
        return Yard(seed).height(x_m.ravel(), y_m.ravel()).reshape(x_m.shape)
    places = [(y_m - ravine.Y0_M) / ravine.CELL_M, (x_m - ravine.X0_M) / ravine.CELL_M]
    return np.asarray(map_coordinates(ravine.heights(), places, order=1, mode="nearest"))


def ground_errors(walk: StereoWalk, first_pose: Floats, kind: str, seed: int) -> Floats:
    """Errors of the map of level ground, NaN elsewhere; their median is 0."""
    field = walk_ground(walk, SPACING_M, ERROR_M, 0.0)
    stand = level_stand(walk, ERROR_M)
    rows, columns = field.z_m.shape
    x, y = np.meshgrid(
        field.x0_m + SPACING_M * np.arange(columns), field.y0_m + SPACING_M * np.arange(rows)
    )
    points = np.stack([x, y, field.z_m - stand.height_m], axis=-1) @ stand.world_from_camera()
    world = points @ first_pose[:, :3].T + first_pose[:, 3]
    truth = true_height(kind, seed, world[..., 0], world[..., 1])
    slope = np.hypot(*np.gradient(truth, SPACING_M))
    off = np.where(field.known & (slope < LEVEL), world[..., 2] - truth, np.nan)
    return np.asarray(off - np.nanmedian(off))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[4, 5, 6, 7, 8])
    chosen = parser.parse_args()
    print(
        "| scene | place off, mm | its sd, mm | distance off | ground off, median, 95 % "
        "| step 99.9 % | CPU |"
    )
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for kind in ("ravine", "yard"):
        for seed in chosen.seeds:
            with tempfile.TemporaryDirectory() as folder:
                file = write_scene(Path(folder), kind, seed)
                config = load(file, WalkthroughConfig)
                begin = time.process_time()
                try:
                    walk = read_walk(file, config)
                except InputError as error:
                    print(f"| {kind} {seed} | rejected: {str(error).split(': ', 2)[-1]} |||||||")
                    continue
                spent_s = time.process_time() - begin
            poses = np.array([position.pose for position in config.positions])
            true_m = np.linalg.norm(np.diff(poses[:, :, 3], axis=0), axis=1)
            ways = [
                step.distance_m / true - 1.0 for step, true in zip(walk.steps, true_m, strict=True)
            ]
            off = ground_errors(walk, poses[0], kind, seed)
            steps = np.concatenate([np.diff(off, axis=axis).ravel() for axis in (0, 1)])
            cells = [
                f"{kind} {seed}",
                ", ".join(f"{1000 * (step.place_error_m or 0):.1f}" for step in walk.steps),
                ", ".join(f"{1000 * step.place_sd_m:.1f}" for step in walk.steps),
                ", ".join(f"{100 * way:+.2f} %" for way in ways),
                f"{1000 * np.nanmedian(np.abs(off)):.1f}, "
                f"{1000 * np.nanquantile(np.abs(off), 0.95):.1f} mm",
                f"{1000 * np.nanquantile(np.abs(steps), 0.999):.1f} mm",
                f"{spent_s:.0f} s",
            ]
            print(f"| {' | '.join(cells)} |", flush=True)
    print(provenance("python -m benchmarks.walkthrough_scenes"))


if __name__ == "__main__":
    main()
