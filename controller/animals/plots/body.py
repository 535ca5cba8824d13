"""A body model as a picture: where it was seen, its skin unrolled, and the solid."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.colours import AMBER, BLUE, HEAD, INK, RED
from snakewalk.controller.animals.mesh.body_model import BodyModel
from snakewalk.controller.animals.mesh.rig import posed_m, spine_rig
from snakewalk.controller.animals.mesh.skin import Skin
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.images.mesh import Mesh
from snakewalk.controller.images.mesh_files import SKIN_RGB
from snakewalk.controller.track.bone_motion import BoneMotion

_SUN = np.array([0.3, 0.5, 0.812])
"""Direction of the light, of length 1 (ours)."""
_SOLID_PX = 1300
"""Longer side of a drawn body, in half pixels (ours)."""


def draw_body(
    file: Path,
    model: BodyModel,
    mesh: Mesh,
    texture: Image | None,
    silhouettes: Sequence[tuple[Image, Floats, Floats]] = (),
) -> None:
    """Write one picture in the format of its ending.

    ``silhouettes`` are image, skeleton (P, 2) and radii (P,), pixels, of each photograph.

    Raises:
        InputError: the ending is not a picture's.

    """
    check_picture(file)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 4.2), layout="constrained", dpi=110)
        halves: Any = figure.subfigures(1, 2, width_ratios=[1.0, 1.6])
        left, right = halves
        if not silhouettes or texture is None:
            _sections(left.subplots(1, 1), model)
        else:
            share = 2.2 / len(silhouettes)
            rows = left.subplots(
                len(silhouettes) + 2, 1, height_ratios=[share] * len(silhouettes) + [0.7, 1.4]
            )
            for axes, silhouette in zip(rows, silhouettes, strict=False):
                _place(axes, *silhouette)
            rows[0].set_title("skeleton, widths, head")
            rows[-2].imshow(texture, aspect="auto")
            rows[-2].set_axis_off()
            rows[-2].set_title("skin unrolled, head at the left")
            _sections(rows[-1], model)
        _solid(right, mesh, texture)
        save_picture(figure, file)


def _place(axes: Axes, image: Image, points: Floats, radius: Floats) -> None:
    axes.imshow(image, cmap="gray")
    axes.plot(*points.T, color=AMBER, linewidth=1.2)
    along = np.gradient(points, axis=0)
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1) / np.hypot(*along.T)[:, None]
    for side in (-1.0, 1.0):
        axes.plot(*(points + side * radius[:, None] * across).T, color=RED, linewidth=0.9)
    axes.plot(*points[0], "o", color=HEAD, markersize=4)
    axes.set_axis_off()


def _sections(axes: Axes, model: BodyModel) -> None:
    s = np.linspace(0.0, 1.0, len(model.half_width))
    axes.plot(s, model.half_width, color=BLUE, label="half width")
    axes.plot(s, model.half_height, color=INK, linestyle="--", label="half height")
    axes.set_ylim(0.0, 1.45 * float(max(model.half_width.max(), model.half_height.max())))
    axes.set_xticks([0.0, 1.0], ["head", "tail"])
    axes.legend(ncols=2, loc="upper center", fontsize=8.5)
    axes.set_ylabel("body lengths")
    axes.set_title("ellipses, over the length")


def draw_skin(file: Path, skin: Skin, motion: BoneMotion | None, texture: Image | None) -> None:
    """Draw a skin at rest, or in four frames of its motion.

    Raises:
        InputError: the ending is not a picture's.

    """
    check_picture(file)
    shown = [0] if motion is None else np.linspace(0, len(motion.time_s) - 1, 5).astype(int)[:4]
    rig = None if motion is None else spine_rig(skin, motion.bone_m)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 5.6), layout="constrained", dpi=110)
        panels: Any = figure.subfigures(1 if motion is None else 2, len(shown) // 2 or 1)
        for frame, panel in zip(shown, np.ravel(panels), strict=True):
            corners = (
                skin.mesh.vertices
                if motion is None or rig is None
                else posed_m(rig, motion, int(frame))
            )
            _solid(panel, replace(skin.mesh, vertices=corners), texture)
            if motion is not None:
                panel.suptitle(f"{motion.time_s[frame]:.2f} s", fontsize=9)
        save_picture(figure, file)


def _solid(figure: Figure, mesh: Mesh, texture: Image | None) -> None:
    axes = figure.add_subplot()
    axes.imshow(_solid_picture(mesh, texture))
    axes.set_axis_off()


def _solid_picture(mesh: Mesh, texture: Image | None) -> Floats:
    """(H, W, 3) parallel view of a mesh in the light of a sun and of the eye, as large as the body.

    Each triangle is sampled more densely than the pixels; the sample nearest to the eye counts.
    """
    azimuth, elevation = np.radians(-62.0), np.radians(38.0)
    c, s, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    view = np.array([[-s, c, 0.0], [c * se, s * se, -ce], [c * ce, s * ce, se]])
    seen = mesh.vertices @ view.T  # right, down, towards the eye
    low = seen[:, :2].min(axis=0)
    scale = _SOLID_PX / float(np.ptp(seen[:, :2], axis=0).max())
    corners = np.column_stack([(seen[:, :2] - low) * scale, seen[:, 2]])[mesh.faces]
    edges = np.linalg.norm(corners[..., :2] - np.roll(corners[..., :2], 1, axis=1), axis=-1)
    level = np.ceil(np.log2(np.maximum(1.2 * edges.max(axis=1), 1.0))).astype(int)
    light = 0.4 + 0.35 * np.clip(mesh.normals @ _SUN, 0.0, 1.0)
    light += 0.25 * np.abs(mesh.normals @ view[2])
    facts = np.column_stack([light, mesh.uv])[mesh.faces]
    groups = []
    for k in np.unique(level):
        i, j = (n.ravel() for n in np.indices((2**k + 1, 2**k + 1)))
        inside = i + j <= 2**k
        parts = np.column_stack([i, j, 2**k - i - j])[inside] / 2**k
        both = np.concatenate([corners[level == k], facts[level == k]], axis=2)
        groups.append(np.einsum("pk,tkv->tpv", parts, both).reshape(-1, 6))
    samples = np.concatenate(groups)
    x, y, _, light, u, v = samples[np.argsort(samples[:, 2])].T
    colour: Floats = np.broadcast_to(SKIN_RGB, (len(x), 3))
    if texture is not None:
        rows = np.rint((1.0 - v) * (texture.shape[0] - 1)).astype(int)
        colour = texture[rows, np.rint(u * (texture.shape[1] - 1)).astype(int)] / 255.0
    column, row = np.rint(x).astype(int), np.rint(y).astype(int)
    picture = np.ones((row.max() // 2 * 2 + 2, column.max() // 2 * 2 + 2, 3))
    picture[row, column] = colour * light[:, None]
    high, wide = (n // 2 for n in picture.shape[:2])
    return np.asarray(picture.reshape(high, 2, wide, 2, 3).mean(axis=(1, 3)))
