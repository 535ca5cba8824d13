"""Local models of all positions, joined along the route ([KP] 3.1)."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.walkthrough import PositionConfig, WalkthroughConfig
from snakewalk.controller.mapping.elevation_choice import CalibrationChoice
from snakewalk.controller.mapping.mosaic.adjustment import (
    Adjusted,
    Sightings,
    adjusted,
    composed,
)
from snakewalk.controller.mapping.mosaic.local_model import LocalModel, moved
from snakewalk.controller.mapping.mosaic.morph import MorphableModel, morphable
from snakewalk.controller.mapping.mosaic.mosaic import mosaic
from snakewalk.controller.mapping.mosaic.relative_pose import (
    LEAST_INLIERS,
    RelativePose,
    estimated_motion,
    matches_around,
    pose_error,
)
from snakewalk.controller.mapping.mosaic.scale_flow import flow_problem, solve_flow
from snakewalk.controller.mapping.stereo_camera import (
    StereoCalibration,
    read_calibration,
    read_pair,
)

_SKIP_RADIUS_PX = 6
"""Search radius between a position and the next but one (ours)."""


@dataclass(frozen=True, slots=True)
class Step:
    """Facts about the way between two positions."""

    matches: int
    inliers: int
    error_px: float
    distance_m: float
    place_sd_m: float
    """Standard deviations of the next position's place and axes."""
    angle_sd_rad: float
    common_share: float
    """Share of the valid region that has a counterpart."""
    place_error_m: float | None = None
    """Errors of the pose; None where the positions' poses are not known."""
    angle_error_rad: float | None = None


@dataclass(frozen=True, slots=True)
class StereoWalk:
    """Models and morphs along a route."""

    models: tuple[LocalModel, ...]
    morphs: tuple[MorphableModel, ...]
    """Morph for each pair of successive positions."""
    poses: Floats
    """(n, 3, 4) from each position's camera to the axes of the first one."""
    steps: tuple[Step, ...]
    calibration: StereoCalibration


def read_walk(
    file: Path, config: WalkthroughConfig, on_step: Callable[[int, int], None] = lambda *_: None
) -> StereoWalk:
    """Build the models and the morphs of a route from ``file`` with content ``config``.

    Pictures are in the file's folder. ``on_step`` is called with (steps done, of).

    Raises:
        InputError: a picture or the calibration is unusable, or two positions do not match.

    """
    calibration = read_calibration(
        file.parent / config.calibration, CalibrationChoice(unit=config.unit)
    )
    count = len(config.positions)
    total = 3 * count - 2
    models = []
    for k, position in enumerate(config.positions):
        with _fault_place(f"{file}: position {k + 1}"):
            models.append(_model(file.parent, position, calibration, config.disparities))
        on_step(k + 1, total)
    if count == 1:
        return StereoWalk(tuple(models), (), np.eye(3, 4)[None], (), calibration)
    motions = []
    groups = []
    for k in range(count - 1):
        with _fault_place(f"{file}: positions {k + 1} and {k + 2}"):
            motion, matches = estimated_motion(
                models[k], models[k + 1], config.positions[k].distance_m
            )
        motions.append(motion)
        groups.append(Sightings.of_matches((k, k + 1), (models[k], models[k + 1]), matches))
        on_step(count + k + 1, total)
    morphs = []
    steps = []
    joint = _jointly(models, groups, motions)
    from_first = [composed(joint.motions, 0, k) for k in range(count)]
    poses = np.linalg.inv([[*motion, (0, 0, 0, 1)] for motion in from_first])[:, :3]
    for k in range(count - 1):
        morph, step = _step(joint, k, groups[k], models[k : k + 2], config.positions[k : k + 2])
        morphs.append(morph)
        steps.append(step)
        on_step(2 * count + k, total)
    return StereoWalk(tuple(models), tuple(morphs), poses, tuple(steps), calibration)


def _jointly(
    models: Sequence[LocalModel], steps: Sequence[Sightings], motions: Sequence[Floats]
) -> Adjusted:
    """Adjust all motions together, with matches between each position and the next but one."""
    groups = list(steps)
    for k in range(len(motions) - 1):
        pair = (models[k], models[k + 2])
        motion = composed(np.array(motions), k, k + 2)
        matches = matches_around(*pair, motion, _SKIP_RADIUS_PX)
        if len(matches.scale) >= LEAST_INLIERS:
            groups.append(Sightings.of_matches((k, k + 2), pair, matches))
    return adjusted(groups, np.array(motions))


@contextmanager
def _fault_place(where: str) -> Iterator[None]:
    """Put a place in front of the faults of a block."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _model(
    folder: Path, position: PositionConfig, calibration: StereoCalibration, disparities: int
) -> LocalModel:
    views = [
        LocalModel.of_pair(
            read_pair(calibration, folder / pair.left, folder / pair.right), disparities
        )
        for pair in position.pairs
    ]
    return views[0] if len(views) == 1 else mosaic(views).model


def _step(
    joint: Adjusted,
    number: int,
    sightings: Sightings,
    models: Sequence[LocalModel],
    positions: tuple[PositionConfig, ...],
) -> tuple[MorphableModel, Step]:
    motion = joint.motions[number]
    agrees = joint.agrees[number]
    moved_m = moved(sightings.points_m[agrees], motion)
    off_px = (sightings.predicted_px(moved_m) - sightings.seen_px[agrees])[:, :2]
    error_px = float(np.sqrt((off_px**2).sum(axis=1).mean()))
    pose = RelativePose(motion[:, :3], motion[:, 3], agrees)
    first, second = models
    morph = morphable(first, second, pose, solve_flow(flow_problem(first, second, pose)))
    errors: tuple[float | None, float | None] = (None, None)
    if positions[0].pose and positions[1].pose:
        errors = pose_error(pose, *(np.array(position.pose) for position in positions))
    step = Step(
        len(agrees),
        int(agrees.sum()),
        error_px,
        float(np.linalg.norm(motion[:, 3])),
        float(joint.place_sd_m[number]),
        float(joint.angle_sd_rad[number]),
        float(morph.common.sum() / max(morph.first.valid.sum(), 1)),
        *errors,
    )
    return morph, step
