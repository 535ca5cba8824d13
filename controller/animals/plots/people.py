"""A person as a picture: curves, skeleton, surface, and stages of the cycle ([GC] Fig. 2 to 11)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.colours import BLUE, INK, RED
from snakewalk.controller.animals.people.skeleton import INDEX
from snakewalk.controller.animals.people.surface import Person
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style


def draw_person(
    file: Path,
    person: Person,
    rest: Image,
    stages: Sequence[tuple[float, Image]],
    title: str,
) -> None:
    """Write one picture in the format of its ending.

    ``rest`` is the surface at rest; ``stages`` are shares of the cycle with pictures.

    Raises:
        InputError: the ending is not a picture's.

    """
    check_picture(file)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 8.4), layout="constrained", dpi=110)
        halves: Any = figure.subfigures(2, 1, height_ratios=[1.0, 1.55])
        top, bottom = halves
        left, middle, right = top.subplots(1, 3)
        _curves(left, person)
        _skeleton(middle, person)
        _picture(right, rest, "PDE surfaces, at rest")
        panels = bottom.subplots(2, len(stages) // 2).ravel()
        for (share, image), axes in zip(stages, panels, strict=True):
            _picture(axes, image, f"{share:.2f} of a cycle")
        bottom.suptitle(title, fontsize=10)
        save_picture(figure, file)


def _picture(axes: Axes, image: Image, title: str) -> None:
    axes.imshow(image)
    axes.set_axis_off()
    axes.set_title(title, fontsize=8.5)


def _curves(axes: Axes, person: Person) -> None:
    """Draw the boundary curves at rest."""
    for curve in (curve_m for part in person.parts for curve_m in part.curves_m):
        axes.plot(*_projected_points(np.vstack([curve, curve[:1]])).T, color=BLUE, linewidth=0.7)
    _frame(axes, person, "boundary curves")


def _skeleton(axes: Axes, person: Person) -> None:
    """Draw the bones, and the handles of the feet."""
    bones = person.skeleton
    place = _projected_points(person.skeleton.joint_m)
    for k, parent in enumerate(bones.parent):
        if parent >= 0:
            axes.plot(*place[[parent, k]].T, color=INK, linewidth=1.4)
    axes.plot(*place.T, "o", color=INK, markersize=2.5)
    handles = [INDEX["left foot"], INDEX["right foot"]]
    axes.plot(*place[handles].T, "s", color=RED, markersize=5)
    _frame(axes, person, "joints, and handles (red)")


def _projected_points(points_m: Floats) -> Floats:
    """(P, 2) points (P, 3) seen from ahead, right and above, without perspective."""
    turn = np.radians(40.0)
    up = np.radians(8.0)
    across = points_m[:, 0] * np.sin(turn) + points_m[:, 1] * np.cos(turn)
    back = points_m[:, 1] * np.sin(turn) - points_m[:, 0] * np.cos(turn)
    return np.stack([across, points_m[:, 2] * np.cos(up) + back * np.sin(up)], axis=-1)


def _frame(axes: Axes, person: Person, title: str) -> None:
    size = person.skeleton.stature_m
    axes.set_aspect("equal")
    axes.set_xlim(-0.36 * size, 0.36 * size)
    axes.set_ylim(-0.05 * size, 1.03 * size)
    axes.set_axis_off()
    axes.set_title(title, fontsize=8.5)
