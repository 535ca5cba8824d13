"""Cameras along a route through the key positions, and their film ([KP] 3.5)."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation, Slerp

from snakewalk.config.arrays import Floats
from snakewalk.controller.mapping.mosaic.rasteriser import Canvas, SecondTexture, draw
from snakewalk.controller.mapping.mosaic.walk import StereoWalk
from snakewalk.sim.rendering.movie_file import MovieFile

_SWAY = 0.04
"""Radius of the circle of the camera at a single position, in median depths (ours)."""


@dataclass(frozen=True, slots=True)
class RouteView:
    """One picture of the film."""

    step: int
    """Number of the position behind the camera."""
    share: float
    """Amount of morphing m."""
    rotation: Floats
    """(3, 3) from the axes of that position to the camera's."""
    place_m: Floats
    """(3,) of the camera, in the axes of that position."""

    @property
    def motion(self) -> Floats:
        """(3, 4) from the axes of that position to the camera's."""
        return self.rotation @ np.column_stack([np.eye(3), -self.place_m])


@dataclass(frozen=True, slots=True)
class FilmFacts:
    """Measures of a film."""

    frames: int
    frame_s: float
    """Median processor time to draw a frame."""
    hole_share: float
    """Mean share of the pixels that no model covers."""


def views_along(walk: StereoWalk, per_step: int) -> Iterator[RouteView]:
    """Cameras from the first position to the last, ``per_step`` per step.

    Places are on a smooth curve through the positions; axes turn at a constant rate. A single
    position is seen from a small circle around it.
    """
    count = len(walk.models)
    if count == 1:
        depth_m = float(np.nanmedian(walk.models[0].points_m[..., 2]))
        for angle in np.arange(2 * per_step) * np.pi / per_step:
            place = _SWAY * depth_m * np.array([np.sin(angle), 0.4 * (np.cos(angle) - 1.0), 0.0])
            yield RouteView(0, 0.0, np.eye(3), place)
        return
    numbers = np.arange(count, dtype=float)
    places = PchipInterpolator(numbers, walk.poses[:, :, 3])
    turns = Slerp(numbers, Rotation.from_matrix(walk.poses[:, :, :3]))
    for step_place in np.linspace(0.0, count - 1.0, per_step * (count - 1) + 1):
        step = min(int(step_place), count - 2)
        first_pose = walk.poses[step]
        axes = turns(step_place).as_matrix()
        yield RouteView(
            step,
            step_place - step,
            axes.T @ first_pose[:, :3],
            first_pose[:, :3].T @ (places(step_place) - first_pose[:, 3]),
        )


def render(
    walk: StereoWalk,
    view: RouteView,
    camera: Floats,
    size_px: tuple[int, int],
    *,
    alone: bool = False,
) -> Canvas:
    """Draw the morphable model of a view.

    ``alone`` leaves its holes empty. Otherwise they show the models of the adjacent positions
    (ours), if these show the place.
    """
    canvas = Canvas.blank(*size_px)
    if walk.morphs:
        morph = walk.morphs[view.step]
        draw(
            canvas,
            morph.points_m(view.share),
            camera @ view.motion,
            morph.cells,
            morph.first.image,
            SecondTexture(morph.second.image, morph.counterpart_px, view.share),
        )
    else:
        _draw_model(canvas, walk, 0, view, camera)
    if not alone:
        for number in (view.step + 1, view.step - 1, view.step + 2):
            if 0 <= number < len(walk.models):
                _draw_model(canvas, walk, number, view, camera)
    return canvas


def _draw_model(
    canvas: Canvas, walk: StereoWalk, number: int, view: RouteView, camera: Floats
) -> None:
    model = walk.models[number]
    pose, base = walk.poses[number], walk.poses[view.step]
    motion = base[:, :3].T @ pose
    motion[:, 3] -= base[:, :3].T @ base[:, 3] + view.place_m
    canvas.blocked = canvas.drawn
    draw(canvas, model.points_m, camera @ view.rotation @ motion, model.cells, model.image)


def film(
    walk: StereoWalk,
    file: Path,
    size_px: tuple[int, int],
    per_step: int,
    fps: int,
    *,
    alone: bool = False,
    on_frame: Callable[[int, int], None] = lambda *_: None,
) -> FilmFacts:
    """Write the film of a route as MP4.

    ``per_step`` is the number of frames between positions; ``alone`` as in ``render``. ``on_frame``
    is called with (frames done, of). ``size_px`` is even.
    """
    views = list(views_along(walk, per_step))
    camera = picture_camera(walk, size_px)
    render_times_s = []
    holes = []
    with MovieFile(file, fps, size_px) as movie:
        for k, view in enumerate(views):
            begin = process_time()
            canvas = render(walk, view, camera, size_px, alone=alone)
            render_times_s.append(process_time() - begin)
            holes.append(1.0 - float(canvas.drawn.mean()))
            movie.add(canvas.with_unseen())
            on_frame(k + 1, len(views))
    return FilmFacts(len(views), float(np.median(render_times_s)), float(np.mean(holes)))


def picture_camera(walk: StereoWalk, size_px: tuple[int, int]) -> Floats:
    """(3, 3) camera whose picture lies within that of the first position."""
    model = walk.models[0]
    tall, wide = model.valid.shape
    scale = max(size_px[1] / tall, size_px[0] / wide)
    focal = scale * model.camera[0, 0]
    return np.array(
        [
            [focal, 0.0, 0.5 * (size_px[0] - 1)],
            [0.0, focal, 0.5 * (size_px[1] - 1)],
            [0.0, 0.0, 1.0],
        ]
    )
