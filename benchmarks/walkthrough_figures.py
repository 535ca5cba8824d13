"""Figures 5, 6 and 7 of [KP] as errors against a rendered ravine.

python -m benchmarks.walkthrough_figures                    # tables, as Markdown
python -m benchmarks.walkthrough_figures --picture FILE     # the three figures of the first step
python -m benchmarks.walkthrough_figures --positions 2      # the first step alone
"""

import argparse
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from matplotlib import colormaps
from scipy.spatial.transform import Rotation

from benchmarks.provenance import provenance
from benchmarks.walkthrough import CAMERA, PLACES_M
from snakewalk.config.arrays import Bools, Floats, Image
from snakewalk.config.loader import load
from snakewalk.config.walkthrough import WalkthroughConfig
from snakewalk.controller.mapping.mosaic.local_model import LocalModel
from snakewalk.controller.mapping.mosaic.morph import MorphableModel
from snakewalk.controller.mapping.mosaic.mosaic import Mosaic, mosaic
from snakewalk.controller.mapping.mosaic.rasteriser import Canvas, draw
from snakewalk.controller.mapping.mosaic.route import RouteView, picture_camera, render, views_along
from snakewalk.controller.mapping.mosaic.walk import StereoWalk, read_walk
from snakewalk.controller.mapping.stereo_camera import RectifiedPair
from tests.oracles.ravine import Station, station, write_route

ANGLES_RAD = (0.0, 0.6, -0.6)
TILT_RAD = 0.1
SMOOTH = 0.02
"""Largest relative step of true depth between neighbours of one surface."""
PER_STEP = 4
"""Views of a step: the third one is halfway, the fourth near the next position."""


def unmorphed(morph: MorphableModel) -> MorphableModel:
    """Return the model of Fig. 5 (b): points without a counterpart keep their places."""
    kept = np.where(morph.common[..., None], morph.destination_m, morph.first.points_m)
    return replace(morph, destination_m=kept)


def false_steps(depth: Floats, truth: Floats, part: Bools) -> Floats:
    """Relative false steps of depth between neighbours, one of which is in a part.

    A false step is the difference between the step of a depth map and the true one, over the
    depth. Neighbours at a true edge do not count.
    """
    found = []
    for axis in (0, 1):
        step, true = np.diff(depth, axis=axis), np.diff(truth, axis=axis)
        first, second = (np.take(part, range(*at), axis=axis) for at in _sides(part.shape[axis]))
        near = np.take(truth, range(part.shape[axis] - 1), axis=axis)
        with np.errstate(invalid="ignore"):
            counts = (first != second) & (np.abs(true / near) < SMOOTH) & np.isfinite(step)
        found.append(np.abs((step - true) / near)[counts])
    return np.concatenate(found)


def _sides(count: int) -> tuple[tuple[int, int], tuple[int, int]]:
    return (0, count - 1), (1, count)


def percent(values: Floats) -> str:
    """Median and 95th percentile as two cells."""
    if len(values) == 0:
        return "- | -"
    return f"{100 * np.median(values):.2f} % | {100 * np.quantile(values, 0.95):.2f} %"


def destination_table(walk: StereoWalk) -> None:
    """Print errors of the destination's depths, and false steps at the edge of Psi (Fig. 5)."""
    print("| positions | part | destination | error, median | 95 % | step, median | 95 % |")
    print("| --- | --- | --- | ---: | ---: | ---: | ---: |")
    for k, morph in enumerate(walk.morphs):
        truth = CAMERA.look(station(PLACES_M[k]), fine=1)[1]
        valid = morph.first.valid & np.isfinite(truth)
        bare = valid & ~morph.common
        kept = unmorphed(morph).destination_m[..., 2]
        filled = morph.destination_m[..., 2]
        for part, name, mask, depth, steps in (
            ("Psi", "Eq. 3 (a)", valid & morph.common, filled, False),
            ("rest", "not morphed (b)", bare, kept, True),
            ("rest", "Eq. 5 (c)", bare, filled, True),
        ):
            error = np.abs(depth / truth - 1.0)[mask]
            step = false_steps(depth, truth, morph.common) if steps else np.empty(0)
            print(
                f"| {k + 1} to {k + 2} | {part} | {name} | {percent(error)} | {percent(step)} |",
                flush=True,
            )


@dataclass(frozen=True)
class Look:
    """The real picture of a view, and its camera."""

    view: RouteView
    real: Image
    camera: Floats


def look(walk: StereoWalk, view: RouteView) -> Look:
    """Render the scene from a view along the estimated route."""
    first, pose = station(PLACES_M[0]), walk.poses[view.step]
    axes = pose[:, :3]
    at = Station(
        first.at_m + first.axes @ (pose[:, 3] + axes @ view.place_m),
        first.axes @ axes @ view.rotation.T,
    )
    return Look(view, CAMERA.look(at)[0], picture_camera(walk, CAMERA.size_px))


def psi_of(walk: StereoWalk, at: Look) -> Bools:
    """(H, W) pixels of a view that show points with a counterpart."""
    morph = walk.morphs[at.view.step]
    canvas = Canvas.blank(*CAMERA.size_px)
    mask = np.repeat(np.where(morph.common, 255, 0).astype(np.uint8)[..., None], 3, axis=2)
    draw(canvas, morph.points_m(at.view.share), at.camera @ at.view.motion, morph.cells, mask)
    return np.asarray(canvas.colour[..., 0] > 127)


def sharpness(picture: Image, part: Bools) -> float:
    """Root mean square of the Laplacian of the grey levels in a part."""
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.float32)
    bent = np.asarray(cv2.Laplacian(grey, cv2.CV_32F))
    inner = cv2.erode(part.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    return float(np.sqrt(np.mean(bent[inner] ** 2)))


def drawn(walk: StereoWalk, at: Look) -> Canvas:
    """Return the picture of the morphing model alone."""
    return render(walk, at.view, at.camera, CAMERA.size_px, alone=True)


def views_table(walk: StereoWalk) -> None:
    """Print errors of rendered views (Fig. 6).

    Errors are grey levels halfway, over the pixels that all three pictures cover. Holes are the
    pixels there that an other picture covers. The detail is the sharpness near the next position,
    over that of the real picture.
    """
    print("| positions | picture | error in Psi | error in the rest | holes | detail, Psi | rest |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |")
    views = list(views_along(walk, PER_STEP))
    bare = replace(walk, morphs=tuple(unmorphed(each) for each in walk.morphs))
    for k in range(len(walk.morphs)):
        halfway, late = (look(walk, views[PER_STEP * k + n]) for n in (2, 3))
        psi, late_psi = psi_of(walk, halfway), psi_of(walk, late)
        still = replace(halfway, view=replace(halfway.view, share=0.0))
        late_still = replace(late, view=replace(late.view, share=0.0))
        rows = {
            "first model, m = 0": (drawn(walk, still), drawn(walk, late_still)),
            "no geometric morphing (a)": (drawn(bare, halfway), drawn(bare, late)),
            "geometric morphing (b)": (drawn(walk, halfway), drawn(walk, late)),
        }
        every = np.logical_and.reduce([each[0].drawn for each in rows.values()])
        some = np.logical_or.reduce([each[0].drawn for each in rows.values()])
        for name, (canvas, end) in rows.items():
            off = np.abs(canvas.colour.astype(float) - halfway.real).mean(axis=-1)
            shares = [
                sharpness(end.colour, part & end.drawn) / sharpness(late.real, part & end.drawn)
                for part in (late_psi, ~late_psi)
            ]
            print(
                f"| {k + 1} to {k + 2} | {name} | {off[every & psi].mean():.1f} | "
                f"{off[every & ~psi].mean():.1f} | "
                f"{100 * (some & ~canvas.drawn).sum() / some.sum():.2f} % | "
                f"{100 * shares[0]:.0f} % | {100 * shares[1]:.0f} % |",
                flush=True,
            )


def model_of(at: Station, seed: int) -> LocalModel:
    """Local model of a rendered pair."""
    left, right = CAMERA.pair(at, seed)
    k = CAMERA.matrix
    seen = np.ones(left.shape[:2], bool)
    centre = float(k[0, 2]), float(k[1, 2])
    pair = RectifiedPair(
        left, right, seen, CAMERA.focal_px, centre, 0.0, CAMERA.baseline_m, np.eye(3)
    )
    return LocalModel.of_pair(pair, 96)


def three_views() -> list[LocalModel]:
    """Local models of three pairs from one place."""
    return [model_of(station(1.0, angle, TILT_RAD), k) for k, angle in enumerate(ANGLES_RAD)]


def scaled(views: list[LocalModel], factors: tuple[float, ...]) -> list[LocalModel]:
    """Return models whose depths are off by factors."""
    return [
        replace(view, points_m=view.points_m * factor)
        for view, factor in zip(views, factors, strict=True)
    ]


def mosaic_truth(found: Mosaic) -> Floats:
    """(H, W) true depths of a mosaic; NaN where a view does not show them."""
    base = station(1.0, 0.0, TILT_RAD)
    camera, shape = found.model.camera, found.model.valid.shape
    truth = np.full(shape, np.nan)
    v, u = np.mgrid[: shape[0], : shape[1]]
    flat = np.stack([(u - camera[0, 2]) / camera[0, 0], (v - camera[1, 2]) / camera[1, 1]], -1)
    rays = np.concatenate([flat, np.ones((*shape, 1))], axis=-1) @ base.axes.T
    for angle in ANGLES_RAD:
        at = station(1.0, angle, TILT_RAD)
        depth = CAMERA.look(at, fine=1)[1].astype(np.float32)
        seen = rays @ at.axes
        forward = np.maximum(seen[..., 2], 1e-6)
        k = CAMERA.matrix
        column, row = (
            (seen[..., axis] / forward * k[axis, axis] + k[axis, 2]).astype(np.float32)
            for axis in (0, 1)
        )
        there = cv2.remap(depth, column, row, cv2.INTER_LINEAR, borderValue=np.nan)
        met = np.asarray(there) / forward
        truth = np.where(np.isfinite(truth) | (seen[..., 2] < 0.1), truth, met)
    return truth


def turned(found: Mosaic) -> Canvas:
    """Picture of a mosaic from its place moved to the side, in which false steps open as holes."""
    tall, wide = found.model.valid.shape
    canvas = Canvas.blank(wide, tall)
    points = found.model.points_m - np.array([0.1, -0.1, 0.1])
    draw(canvas, points, found.model.camera @ np.eye(3, 4), found.model.cells, found.model.image)
    return canvas


def mosaic_table() -> None:
    """Print depths of a mosaic of three views against the truth (Fig. 7)."""
    print(
        "| depths of the side views | rectified | step at the seams, median | 95 % | "
        "error, median | 95 % | cut at the seams | angles off |"
    )
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    views = three_views()
    base = station(1.0, 0.0, TILT_RAD).axes
    for name, factors in (("as measured", (1.0, 1.0, 1.0)), ("6 % off", (1.0, 1.06, 0.94))):
        for rectified in (False, True):
            found = mosaic(scaled(views, factors), rectified)
            truth, depth = mosaic_truth(found), found.model.points_m[..., 2]
            valid = found.model.valid & np.isfinite(truth)
            # a seam is the border of the first view's part inside of the mosaic
            step = false_steps(depth, truth, found.domain[0])
            error = np.abs(depth / truth - 1.0)[valid & ~found.domain[0]]
            off = [
                Rotation.from_matrix(
                    turn.T @ base.T @ station(1.0, angle, TILT_RAD).axes
                ).magnitude()
                for turn, angle in zip(found.rotations, ANGLES_RAD, strict=True)
            ]
            print(
                f"| {name} | {'Eq. 7 (d)' if rectified else 'no (c)'} | {percent(step)} | "
                f"{percent(error)} | {100 * cut(found, truth):.1f} % | "
                f"{1000 * max(off):.1f} mrad |",
                flush=True,
            )


def cut(found: Mosaic, truth: Floats) -> float:
    """Share of the cells over a seam that are not drawn although the true surface goes on."""
    edge, valid = found.domain[0], found.model.valid
    corners = [np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, :-1], np.s_[1:, 1:]]
    inside = np.logical_and.reduce([valid[at] for at in corners])
    count = np.sum([edge[at] for at in corners], axis=0)
    near = np.stack([truth[at] for at in corners])
    with np.errstate(invalid="ignore"):
        smooth = near.max(axis=0) / near.min(axis=0) - 1.0 < 2.0 * SMOOTH
    over = inside & (count > 0) & (count < 4) & smooth
    return float((over & ~found.model.cells).sum() / max(over.sum(), 1))


def figures(walk: StereoWalk, file: Path) -> None:
    """Draw Fig. 5 to 7: errors of depths, rendered views with the real one, and mosaics.

    Red is too far, blue too near; the darkest colours are 2 % off.
    """
    morph = walk.morphs[0]
    kept = unmorphed(morph)
    only = np.where(morph.common, morph.destination_m[..., 2], np.nan)
    truth = CAMERA.look(station(PLACES_M[0]), fine=1)[1]
    maps = (only, kept.destination_m[..., 2], morph.destination_m[..., 2])
    depths = [error_picture(each, truth) for each in maps]
    views = list(views_along(walk, PER_STEP))
    bare = replace(walk, morphs=tuple(unmorphed(each) for each in walk.morphs))
    late = look(walk, views[3])
    middle = [drawn(bare, late).colour, drawn(walk, late).colour, late.real]
    side = scaled(three_views(), (1.0, 1.06, 0.94))
    wide = [turned(mosaic(side, rectified)).colour for rectified in (False, True)]
    rows = [np.hstack(depths), np.hstack(middle)]
    width = rows[0].shape[1]
    for picture in wide:
        tall = round(picture.shape[0] * (width / 2) / picture.shape[1])
        rows.append(
            np.asarray(cv2.resize(picture, (width // 2, tall), interpolation=cv2.INTER_AREA))
        )
    rows[2:] = [np.hstack(rows[2:])]
    cv2.imwrite(str(file), np.vstack(rows)[..., ::-1])


def error_picture(depth: Floats, truth: Floats) -> Image:
    """Relative errors of depths as colours; black without a depth."""
    off = depth / truth - 1.0
    shown = np.rint(255 * colormaps["coolwarm"](0.5 + off / 0.04)[..., :3]).astype(np.uint8)
    shown[~np.isfinite(off)] = 0
    return np.asarray(shown)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--positions", type=int, default=len(PLACES_M))
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        file = write_route(Path(folder), PLACES_M[: chosen.positions], CAMERA)
        walk = read_walk(file, load(file, WalkthroughConfig))
    if chosen.picture is not None:
        figures(walk, chosen.picture)
        return
    words = "python -m benchmarks.walkthrough_figures"
    print(provenance(words + f" --positions {chosen.positions}"))
    print("\nFig. 5\n")
    destination_table(walk)
    print("\nFig. 6\n")
    views_table(walk)
    print("\nFig. 7\n")
    mosaic_table()


if __name__ == "__main__":
    main()
