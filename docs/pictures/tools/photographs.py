"""Render three photographs of a snake whose sides differ, and the skeletons in them."""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from snakewalk.config.animal import SkinConfig
from snakewalk.config.loader import load, load_robot, load_world, locate
from snakewalk.controller.animals.legged.animal_synthesis import as_long_robot
from snakewalk.controller.animals.mesh.body_skin import Cut, model_skin
from snakewalk.controller.animals.mesh.cross_sections import skin_model
from snakewalk.controller.animals.mesh.photographs import AROUND, row_turn_rad
from snakewalk.controller.animals.mesh.skin_texture import ALONG
from snakewalk.sim.rendering.figure_view import FigureView, OrbitCamera
from snakewalk.sim.rendering.looks import SkinLook

SIZE_PX = 960, 240
THICK = 2.2
"""Thickness of the body over that of the plain snake."""
DISTANCE_M, FOVY_DEG = 6.0, 3.3
VIEWS = {"top": (90.0, -90.0), "left": (-90.0, 0.0), "right": (90.0, 0.0)}
"""Azimuth and elevation of the camera; the body lies along -x."""


def pattern() -> np.ndarray:
    """Skin with bands on the back, a yellow left side, a blue right side and a pale belly."""
    s, turn = np.linspace(0.0, 1.0, ALONG)[None], row_turn_rad()[:, None]
    back, left = np.sin(turn), np.cos(turn)
    colour = np.broadcast_to([150.0, 110.0, 60.0], (AROUND, ALONG, 3)).copy()
    colour[np.broadcast_to(left > 0.45, colour.shape[:2])] = [205.0, 170.0, 60.0]
    colour[np.broadcast_to(left < -0.45, colour.shape[:2])] = [75.0, 110.0, 150.0]
    band = np.cos(2.0 * np.pi * 14.0 * s)
    colour[(band > 0.3) & (back > 0.25 * band - 0.2)] = [70.0, 45.0, 30.0]
    colour[np.broadcast_to(back < -0.75, colour.shape[:2])] = [225.0, 215.0, 190.0]
    return colour.astype(np.uint8)


def photographs(folder: Path) -> None:
    """Write ``top.png``, ``left.png``, ``right.png``, ``truth.png``, ``top.npz``, ``side.npz``."""
    slim, _ = skin_model(load(locate("skins", "snake"), SkinConfig))
    model = replace(slim, half_width=THICK * slim.half_width, half_height=THICK * slim.half_height)
    texture = pattern()
    skin = model_skin(model, texture, "snake", Cut(), around=True).skin
    mesh, high = skin.mesh, float(model.half_height.max())
    one = np.zeros((len(mesh.vertices), 1), dtype=np.int64)
    look = SkinLook(
        *(mesh.vertices, mesh.uv, mesh.faces, one, np.ones(one.shape), np.zeros((1, 3))),
        texture,
        free=True,
    )
    view = FigureView(look, as_long_robot(load_robot("yaw16"), 1.0), load_world("flat"), SIZE_PX)
    view._model.vis.global_.fovy = FOVY_DEG
    folder.mkdir(exist_ok=True)
    scale = SIZE_PX[1] / (2.0 * DISTANCE_M * np.tan(np.radians(0.5 * FOVY_DEG)))
    s = np.linspace(0.0, 1.0, len(model.half_width))
    tracks = {}
    for name, (azimuth, elevation) in VIEWS.items():
        camera = OrbitCamera((-0.5, 0.0, high), DISTANCE_M, azimuth, elevation)
        Image.fromarray(view.draw(mesh.vertices, camera)).save(folder / f"{name}.png")
        ahead = 1.0 if name != "left" else -1.0  # the head is on the right, or on the left
        x = 0.5 * (SIZE_PX[0] - 1) + ahead * scale * (0.5 - s)
        y = np.full_like(x, 0.5 * (SIZE_PX[1] - 1))
        if name != "top":
            y += scale * (high - model.half_height)  # the belly lies on the ground
        tracks[name] = np.stack([x, y], axis=-1)
    view.close()
    Image.fromarray(texture).save(folder / "truth.png")
    np.savez(
        folder / "top.npz",
        points_px=tracks["top"][None],
        radius_px=scale * model.half_width[None],
        length_m=1.0,
    )
    np.savez(
        folder / "side.npz",
        points_px=np.stack([tracks["left"], tracks["right"]]),
        radius_px=scale * np.stack([model.half_height] * 2),
    )


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder", type=Path)
    photographs(options.parse_args().folder)
