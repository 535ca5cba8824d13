"""Poses and ground of walk-throughs through drawn scenes, without a guess of any distance.

The ravine is drawn by rays, the yard by MuJoCo with photographs as textures; the quarry has other
photographs and a lens with distortion. Steps are 0.75 to 0.95 m long, with turns. The seeds of the
table are not those of the development (1 to 3). ``step`` is the difference between the errors of
neighbouring samples, ``ledge`` that between the heights of a sample in two models that follow each
other, less the same difference with the true depths of the same pixels; ``true ledge`` is the
latter.

python -m benchmarks.walkthrough_scenes --seeds 4 5 6 7 8
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.provenance import provenance
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load
from snakewalk.config.walkthrough import WalkthroughConfig
from snakewalk.controller.mapping.mosaic.local_model import LocalModel
from snakewalk.controller.mapping.mosaic.walk import StereoWalk, read_walk
from snakewalk.controller.mapping.mosaic.walk_ground import level_stand
from tests.oracles import ravine
from tests.oracles.textured_yard import Yard

SPACING_M = 0.02
ERROR_M = 0.03
SPREAD_M = 0.02
"""Range of the true heights of a sample's pixels up to which it shows one surface."""


def write_scene(folder: Path, kind: str, seed: int) -> Path:
    """Write the pictures of four positions; return the positions' file."""
    if kind != "ravine":
        yard = _yard(kind, seed)
        stations = yard.stations(4)
        pairs = yard.pairs(stations)
        return ravine.write_positions(folder, yard, stations, pairs, yard.distortion)
    rng = np.random.default_rng(seed)
    lens = ravine.Camera((420, 320), float(rng.uniform(320.0, 420.0)))
    steps_m = [float(rng.uniform(0.0, 2.0)), *rng.uniform(0.8, 0.92, 3)]
    turns_rad = rng.uniform(-0.087, 0.087, 4)
    stations = [
        ravine.station(float(x), float(turn))
        for x, turn in zip(np.cumsum(steps_m), turns_rad, strict=True)
    ]
    shots = [lens.pair(at, number) for number, at in enumerate(stations)]
    return ravine.write_positions(folder, lens, stations, shots)


def true_points_m(model: LocalModel, pose: Floats, kind: str, seed: int) -> Floats:
    """(H, W, 3) points that the model's pixels truly show, in the model's axes."""
    points_m = np.full_like(model.points_m, np.nan)
    rays = model.points_m[model.valid] / model.points_m[model.valid][:, 2:]
    turned = rays @ pose[:, :3].T
    if kind == "ravine":
        depth_m = ravine.reaches_m(pose[:, 3], turned)
    else:
        depth_m = _yard(kind, seed).reaches_m(pose[:, 3], turned)
    points_m[model.valid] = depth_m[:, None] * rays
    return points_m


def _yard(kind: str, seed: int) -> Yard:
    return Yard.quarry(seed) if kind == "quarry" else Yard(seed)


def heights_m(points_m: Floats, low_m: Floats, size: tuple[int, int]) -> tuple[Floats, Floats]:
    """(rows, columns) median and range of the heights of points (n, 3) in each cell of a grid."""
    column, row = np.rint((points_m[:, :2] - low_m) / SPACING_M).astype(int).T
    inside = (row >= 0) & (row < size[0]) & (column >= 0) & (column < size[1])
    cell = (row * size[1] + column)[inside]
    z = points_m[inside, 2]
    order = np.lexsort((z, cell))
    cells, begin, count = np.unique(cell[order], return_index=True, return_counts=True)
    begin, count, cells = begin[count >= 2], count[count >= 2], cells[count >= 2]
    middle, extent = np.full(size[0] * size[1], np.nan), np.full(size[0] * size[1], np.nan)
    middle[cells] = 0.5 * (z[order[begin + (count - 1) // 2]] + z[order[begin + count // 2]])
    extent[cells] = z[order[begin + count - 1]] - z[order[begin]]
    return middle.reshape(size), extent.reshape(size)


def ground_errors(
    walk: StereoWalk, true_poses: Floats, kind: str, seed: int
) -> tuple[Floats, Floats, Floats]:
    """Errors of the map, of the ledges between models, and the true ledges.

    The truth of a sample is that of its pixels. Samples whose true heights differ by more than
    ``SPREAD_M`` are left out: they show several surfaces. The median error is 0.
    """
    stand = level_stand(walk, ERROR_M)
    level = stand.world_from_camera()
    first = true_poses[0]
    seen = []
    true = []
    for model, pose, true_pose in zip(walk.models, walk.poses, true_poses, strict=True):
        truth = true_points_m(model, true_pose, kind, seed)
        good = model.near(ERROR_M) & np.isfinite(truth[..., 2])
        seen.append((model.points_m[good] @ pose[:, :3].T + pose[:, 3]) @ level.T)
        world = truth[good] @ true_pose[:, :3].T + true_pose[:, 3]
        true.append((world - first[:, 3]) @ first[:, :3] @ level.T)
    together = np.concatenate(seen)
    low_m = together[:, :2].min(axis=0)
    wide, tall = np.ceil((together[:, :2].max(axis=0) - low_m) / SPACING_M).astype(int) + 1
    size = (int(tall), int(wide))
    is_one = heights_m(np.concatenate(true), low_m, size)[1] < SPREAD_M
    measured = heights_m(together, low_m, size)[0]
    off = np.where(is_one, measured - heights_m(np.concatenate(true), low_m, size)[0], np.nan)
    ledges = []
    true_ledges = []
    for k in range(len(seen) - 1):
        ledge, true_ledge = (
            heights_m(points[k + 1], low_m, size)[0] - heights_m(points[k], low_m, size)[0]
            for points in (seen, true)
        )
        ledges.append((ledge - true_ledge)[is_one])
        true_ledges.append(true_ledge[is_one])
    return off - np.nanmedian(off), np.concatenate(ledges), np.concatenate(true_ledges)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[4, 5, 6, 7, 8])
    parser.add_argument("--scenes", nargs="+", default=["ravine", "yard", "quarry"])
    chosen = parser.parse_args()
    print(
        "| scene | place off, mm | its sd, mm | distance off | ground off, median, 95 % "
        "| step 99.9 % | ledge 95, 99.9 % | true ledge 99.9 % | CPU |"
    )
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for kind in chosen.scenes:
        for seed in chosen.seeds:
            with tempfile.TemporaryDirectory() as folder:
                file = write_scene(Path(folder), kind, seed)
                config = load(file, WalkthroughConfig)
                begin = time.process_time()
                try:
                    walk = read_walk(file, config)
                except InputError as error:
                    print(f"| {kind} {seed} | rejected: {str(error).split(': ', 2)[-1]} |||||||||")
                    continue
                spent_s = time.process_time() - begin
            poses = np.array([position.pose for position in config.positions])
            true_m = np.linalg.norm(np.diff(poses[:, :, 3], axis=0), axis=1)
            ways = [
                step.distance_m / true - 1.0 for step, true in zip(walk.steps, true_m, strict=True)
            ]
            off, ledges, true_ledges = ground_errors(walk, poses, kind, seed)
            steps = np.concatenate([np.diff(off, axis=axis).ravel() for axis in (0, 1)])
            cells = [
                f"{kind} {seed}",
                ", ".join(f"{1000 * (step.place_error_m or 0):.1f}" for step in walk.steps),
                ", ".join(f"{1000 * step.place_sd_m:.1f}" for step in walk.steps),
                ", ".join(f"{100 * way:+.2f} %" for way in ways),
                f"{1000 * np.nanmedian(np.abs(off)):.1f}, "
                f"{1000 * np.nanquantile(np.abs(off), 0.95):.1f} mm",
                f"{1000 * np.nanquantile(np.abs(steps), 0.999):.1f} mm",
                f"{1000 * np.nanquantile(np.abs(ledges), 0.95):.1f}, "
                f"{1000 * np.nanquantile(np.abs(ledges), 0.999):.1f} mm",
                f"{1000 * np.nanquantile(np.abs(true_ledges), 0.999):.1f} mm",
                f"{spent_s:.0f} s",
            ]
            print(f"| {' | '.join(cells)} |", flush=True)
    print(provenance("python -m benchmarks.walkthrough_scenes"))


if __name__ == "__main__":
    main()
