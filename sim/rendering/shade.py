"""The body's shade on the ground, as flat dark patches under the sun.

MuJoCo's shadow maps need half of a software renderer's time. With OSMesa they also omit everything
below half a metre.
"""

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig

SUN_DIRECTION = np.array([0.48, 0.52, -0.7071])
"""In which its light travels."""
DARK = np.array([0.02, 0.03, 0.06, 0.30], dtype=np.float32)
LIFT_M = 0.002
"""Above the ground, so that the two do not flicker into each other."""


def add_shade(
    scene: mujoco.MjvScene,
    links_m: Floats,
    forward: Floats,
    robot: RobotConfig,
    ground: HeightField | None,
) -> None:
    """Append one patch per link to a scene that was just updated and has enough free geoms.

    ``links_m`` (L, 3) are the centres of the links, ``forward`` (L, 3) their axes.
    """
    place, normal = _on_ground(links_m, ground)
    place = place + LIFT_M * normal
    ahead = forward - (forward * normal).sum(axis=1, keepdims=True) * normal
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    side = np.cross(normal, ahead)
    thin = 1.0 - 0.5 * np.clip(np.linspace(0.0, 1.0, len(links_m)) - 0.55, 0.0, None) / 0.45
    for k in range(len(links_m)):
        size = np.array(
            [0.62 * robot.length_m / len(links_m), thin[k] * robot.body_radius_m, 0.001]
        )
        axes = np.stack([ahead[k], side[k], normal[k]], axis=1).ravel()
        patch = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(patch, mujoco.mjtGeom.mjGEOM_ELLIPSOID, size, place[k], axes, DARK)
        scene.ngeom += 1


def _on_ground(links_m: Floats, ground: HeightField | None) -> tuple[Floats, Floats]:
    """Where the sun's rays through (L, 3) points meet the ground, and its normals (L, 3) there."""
    slide = SUN_DIRECTION[:2] / -SUN_DIRECTION[2]
    place = links_m.copy()
    if ground is None:
        place[:, :2] += links_m[:, 2:] * slide
        place[:, 2] = 0.0
        return place, np.tile([0.0, 0.0, 1.0], (len(links_m), 1))
    height = links_m[:, 2] - ground.elevation_m(links_m[:, 0], links_m[:, 1])
    place[:, :2] += np.clip(height, 0.0, None)[:, None] * slide
    place[:, 2] = ground.elevation_m(place[:, 0], place[:, 1])
    east, north = ground.gradient(place[:, 0], place[:, 1])
    normal = np.stack([-east, -north, np.ones_like(east)], axis=1)
    return place, normal / np.linalg.norm(normal, axis=1, keepdims=True)
