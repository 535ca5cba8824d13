"""A body model as a picture: where it was seen, its skin unrolled, and the solid."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.colours import AMBER, BLUE, INK, RED
from snakewalk.controller.animals.mesh.body_model import BodyModel
from snakewalk.controller.animals.mesh.rig import posed_m, spine_rig
from snakewalk.controller.animals.mesh.skin import Skin
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.images.mesh import Mesh
from snakewalk.controller.images.mesh_files import SKIN_RGB
from snakewalk.controller.track.bone_motion import BoneMotion

_SUN = np.array([0.3, 0.5, 0.81])


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
    axes.plot(*points[0], "o", color=BLUE, markersize=4)
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
    """Draw a skin at rest, or in four frames of its motion, all to one scale.

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
    """Draw the mesh in the light of one sun, each face in the colour at its middle."""
    axes = figure.add_subplot(projection="3d")
    triangles = mesh.vertices[mesh.faces]
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    shade = 0.45 + 0.55 * np.clip(normal @ (_SUN / np.linalg.norm(_SUN)), 0.0, 1.0)
    if texture is None:
        colour = np.broadcast_to(SKIN_RGB, (len(normal), 3))
    else:
        u, v = mesh.uv[mesh.faces].mean(axis=1).T
        rows = np.rint((1.0 - v) * (texture.shape[0] - 1)).astype(int)
        columns = np.rint(u * (texture.shape[1] - 1)).astype(int)
        colour = texture[rows, columns] / 255.0
    axes.add_collection3d(
        Poly3DCollection(triangles, facecolors=np.clip(colour * shade[:, None], 0, 1), linewidths=0)
    )
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_zlim(low[2], high[2])
    axes.set_box_aspect(np.maximum(high - low, 1e-9), zoom=1.05)
    axes.view_init(elev=38.0, azim=-62.0)
    axes.set_axis_off()
