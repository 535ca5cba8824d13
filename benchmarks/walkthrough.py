"""Walk-through of a rendered ravine: poses, matches, flow ([KP] Fig. 3, 4), and time per frame.

``benchmarks.walkthrough_figures`` measures Fig. 5 to 7.

python -m benchmarks.walkthrough                    # tables, as Markdown
python -m benchmarks.walkthrough --write FOLDER     # pictures and positions.toml of the same route
python -m benchmarks.walkthrough --motorcycle FOLDER  # a real pair as a single position
python -m benchmarks.walkthrough --picture FILE     # stages as one picture
python -m benchmarks.walkthrough --positions 2      # the first step alone
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.provenance import provenance
from snakewalk.config.arrays import Bools, Floats, Image
from snakewalk.config.loader import load
from snakewalk.config.walkthrough import WalkthroughConfig
from snakewalk.controller.mapping.mosaic.labelling import cheapest, descend, labelled
from snakewalk.controller.mapping.mosaic.local_model import project
from snakewalk.controller.mapping.mosaic.relative_pose import RelativePose
from snakewalk.controller.mapping.mosaic.route import picture_camera, render, views_along
from snakewalk.controller.mapping.mosaic.scale_flow import (
    PENALTY,
    FlowProblem,
    flow_of_labels,
    flow_problem,
    solve_flow,
)
from snakewalk.controller.mapping.mosaic.scale_matches import SCALES, match_over_scale
from snakewalk.controller.mapping.mosaic.walk import StereoWalk, read_walk
from tests.oracles.labelling_energy import energy
from tests.oracles.motorcycle import true_depth, write_motorcycle
from tests.oracles.ravine import Camera, Station, station, write_route

PLACES_M = (0.0, 0.7, 1.4, 2.1, 2.8, 3.5)
CAMERA = Camera()
Truth = tuple[Floats, Floats, Bools]


def truth(first: Station, second: Station) -> Truth:
    """Flow (H, W, 2) between two stations, scale (H, W), and whether the second shows the point."""
    depth, depth_two = (CAMERA.look(at, fine=1)[1] for at in (first, second))
    wide, tall = CAMERA.size_px
    u, v = np.meshgrid(np.arange(wide), np.arange(tall))
    k = CAMERA.matrix
    rays = np.stack([(u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1], np.ones_like(depth)], -1)
    world = (rays * depth[..., None]) @ first.axes.T + first.at_m
    there = (world - second.at_m) @ second.axes
    place = project(k, there)
    column, row = np.rint(np.nan_to_num(place, nan=-1.0)).astype(int).transpose(2, 0, 1)
    inside = (column >= 0) & (column < wide) & (row >= 0) & (row < tall)
    shown = np.zeros(depth.shape, bool)
    hit = depth_two[row[inside], column[inside]]
    shown[inside] = np.abs(hit / there[..., 2][inside] - 1.0) < 0.03
    return place - np.stack([u, v], -1), depth / there[..., 2], shown


def matches_table(walk: StereoWalk, known: list[Truth]) -> None:
    """Fig. 3: matches over ten scales and at one scale."""
    print("| positions | scales | matches | within 2 px | within 4 px | median scale error |")
    print("| --- | --- | ---: | ---: | ---: | ---: |")
    for k, (flow, scale, _) in enumerate(known):
        for scales in (SCALES, (1.0,)):
            first, second = walk.models[k], walk.models[k + 1]
            found = match_over_scale(first, second, scales)
            column, row = found.first_px.astype(int).T
            off = np.linalg.norm(found.second_px - found.first_px - flow[row, column], axis=1)
            off = np.nan_to_num(off, nan=np.inf)
            ratio = np.abs(found.scale / scale[row, column] - 1.0)
            print(
                f"| {k + 1} to {k + 2} | {len(scales)} | {len(off)} | {100 * (off < 2).mean():.0f} "
                f"% | {100 * (off < 4).mean():.0f} % | {100 * np.nanmedian(ratio):.0f} % |"
            )


def flow_row(name: str, problem: FlowProblem, flow_px: Floats, known: Truth, value: str) -> None:
    """Print the errors of a flow of labelled pixels that the second picture shows."""
    grid = np.ix_(problem.rows, problem.columns)
    off = np.linalg.norm(flow_px - known[0][grid], axis=-1)
    shown = known[2][grid]
    has = np.isfinite(off) & shown
    print(
        f"| {name} | {100 * has.sum() / shown.sum():.0f} % | {np.median(off[has]):.2f} px | "
        f"{100 * (off[has] < 1).mean():.0f} % | {100 * (off[has] < 2).mean():.0f} % | {value} |"
    )


def flow_table(walk: StereoWalk, known: list[Truth], off_m: float) -> None:
    """Fig. 4: flow of the first step, by solver, with a pose that is off by a length."""
    print("| flow | labelled | median | within 1 px | within 2 px | energy |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    first, second = walk.models[:2]
    pose = walk.morphs[0].pose
    turn = Rotation.from_rotvec([0.0, 0.1 * off_m, 0.0]).as_matrix()
    shift = pose.translation_m + off_m * np.array([0.6, 0.0, 0.8])
    pose = RelativePose(turn @ pose.rotation, shift, pose.inliers)
    problem = flow_problem(first, second, pose, search_px=8 if off_m else 6)
    level = np.zeros_like(problem.base)
    flow_row("geometry and pose alone", problem, problem.expected_px, known[0], "")
    solved = {
        "data terms alone": (cheapest(problem.costs), level),
        "conditional modes": (cheapest(problem.costs), level),
        "aggregated paths": (labelled(problem.costs, level, PENALTY), level),
        "aggregated paths, printed Potts term": (
            labelled(problem.costs, problem.base, PENALTY), problem.base,
        ),
    }  # fmt: skip
    descend(problem.costs, level, PENALTY, 20, solved["conditional modes"][0])
    for name, (labels, base) in solved.items():
        value = f"{energy(problem.costs, base, PENALTY, labels):.0f}"
        flow_row(name, problem, flow_of_labels(problem, labels).flow_px, known[0], value)
    one = flow_problem(first, second, pose, (1.0,), search_px=8 if off_m else 6)
    flow_row("aggregated paths, one scale", one, solve_flow(one).flow_px, known[0], "")


def pose_table(walk: StereoWalk) -> None:
    """Poses between positions against the truth."""
    print("| positions | matches | inliers | place off | its sd | axes off | common |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for k, step in enumerate(walk.steps):
        assert step.place_error_m is not None
        assert step.angle_error_rad is not None
        print(
            f"| {k + 1} to {k + 2} | {step.matches} | {step.inliers} | "
            f"{1000 * step.place_error_m:.1f} mm | {1000 * step.place_sd_m:.1f} mm | "
            f"{1000 * step.angle_error_rad:.1f} mrad | "
            f"{100 * step.common_share:.0f} % |"
        )


def real_pair(folder: Path) -> None:
    """Write the motorcycle pair, and print errors of its model and of a film around it."""
    file = write_motorcycle(folder)
    print(file)
    walk = read_walk(file, load(file, WalkthroughConfig))
    (model,), truth = walk.models, true_depth()
    known = np.isfinite(truth)
    error = np.abs(model.points_m[..., 2] / truth - 1.0)[known & model.valid]
    camera = picture_camera(walk, (640, 480))
    holes = [
        1.0 - render(walk, view, camera, (640, 480)).drawn.mean() for view in views_along(walk, 4)
    ]
    print("| valid | depth error, median | within 1 % | within 5 % | holes of the film |")
    print("| ---: | ---: | ---: | ---: | ---: |")
    print(
        f"| {100 * model.valid.mean():.0f} % | {100 * np.median(error):.2f} % | "
        f"{100 * (error < 0.01).mean():.0f} % | {100 * (error < 0.05).mean():.0f} % | "
        f"{100 * np.mean(holes):.0f} % |"
    )
    print(provenance(f"python -m benchmarks.walkthrough --motorcycle {folder.name}"))


def stages(walk: StereoWalk, file: Path) -> None:
    """Draw the first step: photograph, morph at 0, 0.5 and 1, next photograph, scale map, Psi."""
    morph = walk.morphs[0]
    camera = picture_camera(walk, CAMERA.size_px)
    views = list(views_along(walk, 4))
    drawn = [render(walk, views[k], camera, CAMERA.size_px).colour for k in (0, 2, 4)]
    flow = solve_flow(flow_problem(morph.first, morph.second, morph.pose))
    scale = np.nan_to_num(flow.scale, nan=1.0)
    level = np.clip(255 * (scale - 1.0) / 2.0, 0, 255).astype(np.uint8)
    level = np.asarray(cv2.resize(level, CAMERA.size_px, interpolation=cv2.INTER_NEAREST), np.uint8)
    share = np.where(morph.common, 1.0, 0.25)[..., None]
    psi = np.asarray(share * morph.first.image, dtype=np.uint8)
    upper = np.hstack([morph.first.image, morph.second.image, psi])
    lower = np.hstack([drawn[0], drawn[1], drawn[2]])
    third = np.hstack(
        [
            np.repeat(level[..., None], 3, axis=2),
            _depth_picture(morph.first.points_m[..., 2]),
            _depth_picture(morph.destination_m[..., 2]),
        ]
    )
    cv2.imwrite(str(file), np.vstack([upper, lower, third])[..., ::-1])


def _depth_picture(depth: Floats) -> Image:
    grey = np.clip(255.0 * 0.6 / np.nan_to_num(depth, nan=1e9), 0, 255).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--motorcycle", type=Path)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--positions", type=int, default=len(PLACES_M))
    chosen = parser.parse_args()
    if chosen.write is not None:
        chosen.write.mkdir(parents=True, exist_ok=True)
        print(write_route(chosen.write, PLACES_M, CAMERA))
        return
    if chosen.motorcycle is not None:
        real_pair(chosen.motorcycle)
        return
    with tempfile.TemporaryDirectory() as folder:
        file = write_route(Path(folder), PLACES_M[: chosen.positions], CAMERA)
        walk = read_walk(file, load(file, WalkthroughConfig))
    if chosen.picture is not None:
        stages(walk, chosen.picture)
        return
    print(provenance("python -m benchmarks.walkthrough"))
    stations = [station(x_m) for x_m in PLACES_M[: chosen.positions]]
    known = [truth(*stations[k : k + 2]) for k in range(len(stations) - 1)]
    tables: list[tuple[str, Callable[[], None]]] = [
        ("Matches", lambda: matches_table(walk, known)),
        ("Poses", lambda: pose_table(walk)),
        ("Flow, estimated pose", lambda: flow_table(walk, known, 0.0)),
        ("Flow, pose 40 mm off", lambda: flow_table(walk, known, 0.04)),
    ]
    for title, table in tables:
        print(f"\n{title}\n", flush=True)
        table()
    camera = picture_camera(walk, (640, 480))
    took = []
    for view in views_along(walk, 3):
        begin = time.process_time()
        render(walk, view, camera, (640, 480))
        took.append(time.process_time() - begin)
    print(f"\nA frame of 640 by 480 px needs {1000 * np.median(took):.0f} ms of processor time.")


if __name__ == "__main__":
    main()
