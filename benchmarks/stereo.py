"""Stereo: disparities of a real pair beside OpenCV's matcher, and heights of rendered ground.

python -m benchmarks.stereo            # both tables, as Markdown
"""

import argparse
import time
from dataclasses import dataclass

import cv2
import numpy as np
import skimage.data

from snakewalk.config.arrays import Bools, Floats, Image
from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.mapping.disparity import match
from snakewalk.controller.mapping.stereo_camera import RectifiedPair
from snakewalk.controller.mapping.stereo_ground import CameraStand, stereo_ground
from snakewalk.sim.rendering.stereo_view import StereoView

WORLDS = ("jacksboro-basin", "random-10")
HEIGHT_M, TILT_RAD = 0.5, 0.55
FAR_M, SPACING_M, ERROR_M = 2.0, 0.03, 0.03
BASELINE_M, FOCAL_PX = 0.1, 500.0


def opencv(left: Image, right: Image, count: int) -> Floats:
    """OpenCV's matcher with the penalties of its documentation and its own left-right check."""
    channels, block = left.shape[2], 5
    matcher = cv2.StereoSGBM.create(
        0, count, block, 8 * channels * block**2, 32 * channels * block**2, 1, 0, 10, 100, 2
    )
    found = matcher.compute(left, right).astype(float) / 16.0
    return np.where(found > 0.0, found, np.nan)


def widened_opencv(left: Image, right: Image, count: int) -> Floats:
    """OpenCV's matcher with the left border that ``match`` adds as well."""
    wide = [
        np.asarray(cv2.copyMakeBorder(one, 0, 0, count, 0, cv2.BORDER_REPLICATE), dtype=np.uint8)
        for one in (left, right)
    ]
    return opencv(wide[0], wide[1], count)[:, count:]


def real_pair() -> None:
    """scikit-image's motorcycle (Middlebury 2014, a quarter of its size)."""
    left, right, truth = skimage.data.stereo_motorcycle()  # type: ignore[no-untyped-call]
    has_truth = np.isfinite(truth)
    print("| matcher | reported | within 1 px | 2 px | of reported: 1 px | 2 px | median | CPU |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name, matcher in MATCHERS.items():
        begin = time.process_time()
        found = matcher(left, right, 80)
        took = time.process_time() - begin
        told = has_truth & np.isfinite(found)
        error = np.abs(found - truth)[told]
        all_of, within = has_truth.sum(), [(error <= px).sum() for px in (1.0, 2.0)]
        shares = [
            told.sum() / all_of,
            *(n / all_of for n in within),
            *(n / len(error) for n in within),
        ]
        cells = " | ".join(f"{100 * share:.1f} %" for share in shares)
        print(f"| {name} | {cells} | {np.median(error):.3f} px | {took:.1f} s |")


FILL_PX = 16
"""Gaps up to this width are filled in the last row of the first table."""


def filled(left: Image, right: Image, count: int) -> Floats:
    """Match as maps do, with short gaps filled."""
    return match(left, right, count, fill_px=FILL_PX)


MATCHERS = {
    "OpenCV `StereoSGBM`": opencv,
    "the same with a left border": widened_opencv,
    "`world stereo`": match,
    "the same with filled gaps": filled,
}


@dataclass(frozen=True)
class View:
    """One view of rendered ground, and how far its map is off."""

    error_m: Floats
    """(n,) of the known samples' heights."""
    in_map: Bools
    """(k,) of the samples of the true ground within the left picture and ``FAR_M``; those behind
    hills count."""
    lean_rad: float
    """Of the map's vertical from the true one."""


def rendered(world_name: str, seed: int, given: bool) -> View:
    """Take a pair of pictures of a place by chance, and map it."""
    world, robot = load_world(world_name), load_robot("alternating16")
    ground = build_ground(world)
    assert ground is not None
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-0.3, 0.3, 2) * ground.size_m
    heading, tilt = float(rng.uniform(-np.pi, np.pi)), TILT_RAD + float(rng.normal(0.0, 0.05))
    lens_m = float(ground.elevation_m(x, y)) + HEIGHT_M
    view = StereoView(robot, world, ground, focal_px=FOCAL_PX, baseline_m=BASELINE_M, seed=seed)
    left, right = view.pictures((x, y, lens_m), heading, tilt)
    centre = float(view.camera_matrix[0, 2]), float(view.camera_matrix[1, 2])
    view.close()
    seen = np.ones(left.shape[:2], bool)
    pair = RectifiedPair(left, right, seen, FOCAL_PX, centre, 0.0, BASELINE_M, np.eye(3))
    stand = CameraStand(HEIGHT_M, tilt, 0.0)
    found = stereo_ground(
        pair, 128, SPACING_M, ERROR_M, stand if given else None, FAR_M, is_level=True
    )
    field, c, s = found.elevation, np.cos(heading), np.sin(heading)
    level = stand.world_from_camera()
    turned = found.stand.world_from_camera() @ level.T  # to the map's frame
    rows, columns = field.z_m.shape
    row, column = np.nonzero(field.known)
    points = np.stack([field.x0_m + column * SPACING_M, field.y0_m + row * SPACING_M], axis=-1)
    mapped = np.column_stack([points, field.z_m[field.known] - found.stand.height_m]) @ turned
    true_m = ground.elevation_m(
        x + c * mapped[:, 0] - s * mapped[:, 1], y + s * mapped[:, 0] + c * mapped[:, 1]
    )
    ahead, beside = np.meshgrid(
        np.arange(0.0, FAR_M, SPACING_M), np.arange(-FAR_M, FAR_M, SPACING_M)
    )
    at = x + c * ahead - s * beside, y + s * ahead + c * beside
    all_of = np.stack([ahead, beside, ground.elevation_m(*at) - lens_m], axis=-1)
    seen_m = all_of @ level
    u, v = (FOCAL_PX * seen_m[..., k] / np.maximum(seen_m[..., 2], 1e-6) for k in (0, 1))
    inside = ground.contains(*at) & (np.abs(u) < centre[0]) & (np.abs(v) < centre[1])
    inside &= seen_m[..., 2] > 0.1
    places = (all_of[inside] @ turned.T)[:, :2] - [field.x0_m, field.y0_m]
    column, row = np.rint(places / SPACING_M).astype(int).T
    held = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    known = np.zeros(len(places), bool)
    known[held] = field.known[row[held], column[held]]
    return View(mapped[:, 2] + lens_m - true_m, known, float(np.arccos(min(turned[2, 2], 1.0))))


def rendered_table(seeds: int, first: int) -> None:
    """Height error and coverage over views by chance."""
    print("| world | stand | views | in map | RMS | median | 95 % | mean | worst RMS | lean |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for world in WORLDS:
        for given in (True, False):
            views = [rendered(world, seed, given) for seed in range(first, first + seeds)]
            error = np.concatenate([view.error_m for view in views])
            size = np.abs(error)
            numbers = (
                np.sqrt((error**2).mean()),
                np.median(size),
                np.quantile(size, 0.95),
                error.mean(),
                max(np.sqrt((view.error_m**2).mean()) for view in views),
            )
            cells = " | ".join(f"{1000 * number:.1f} mm" for number in numbers)
            share = 100 * np.concatenate([view.in_map for view in views]).mean()
            lean = np.degrees(np.mean([view.lean_rad for view in views]))
            how = "given" if given else "fitted"
            print(f"| `{world}` | {how} | {seeds} | {share:.0f} % | {cells} | {lean:.1f} deg |")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=0)
    told = parser.parse_args()
    real_pair()
    print()
    rendered_table(told.seeds, told.first_seed)
