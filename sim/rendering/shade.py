"""The body's shade on the ground under the sun.

MuJoCo's shadow maps need half of a software renderer's time; with OSMesa they omit everything below
half a metre. A film draws one soft shadow (``SoftShade``). The simulated overhead camera draws a
flat dark patch per link (``add_shade``).
"""

import mujoco
import numpy as np
from scipy.ndimage import binary_closing, gaussian_filter

from snakewalk.config.arrays import Floats, Image, Ints
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig

SUN_DIRECTION = np.array([0.48, 0.52, -0.7071])
"""Direction in which the sunlight travels."""
DARK = np.array([0.02, 0.03, 0.06, 0.30], dtype=np.float32)
LIFT_M = 0.002
"""Height of the shadow above the ground, so that the two do not flicker into each other."""

SHADE = "shade"
"""Name of the skin and the texture of a soft shadow."""
_GRID = 48
"""Cells of the sheet on the ground that carries a soft shadow, along each side."""
_DARKEST = 0.5
"""Share of the light that a soft shadow removes: about that of the sun (ours)."""
_LAYER = 1.0 - (1.0 - _DARKEST) ** 0.5
"""Share for one layer: MuJoCo draws a transparent skin twice, its back and its front."""
_TEXELS = 128
_SOFT = 1.6
"""Standard deviation of the edge, texels."""
_SOFT_LIFT = 0.004
"""Height of the sheet above the ground, over its side."""


class SoftShade:
    """One soft shadow of a body: a sheet on the ground with a dark texture."""

    def __init__(self, model: mujoco.MjModel, ground: HeightField | None) -> None:
        """Use the sheet of ``add_sheet``."""
        self._model = model
        self._ground = ground
        self.texture = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXTURE, SHADE)
        skin = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SKIN, SHADE)
        start = int(model.skin_vertadr[skin])
        self._rows = slice(start, start + int(model.skin_vertnum[skin]))

    def lay(self, scene: mujoco.MjvScene, body_m: Floats) -> None:
        """Lay the shadow of surface points (P, 3) into an updated scene.

        The model's texture changes; ``Offscreen.reload`` uploads it.
        """
        place = under_sun(body_m, self._ground)
        low, high = place.min(axis=0), place.max(axis=0)
        side_m = 1.25 * float((high - low).max()) + 1e-6
        corner = 0.5 * (low + high - side_m)
        address = int(self._model.tex_adr[self.texture])
        size = _TEXELS * _TEXELS * 4
        picture = shade_picture((place - corner) / side_m)
        self._model.tex_data[address : address + size] = picture.ravel()
        steps = np.linspace(0.0, side_m, _GRID + 1)
        east, north = np.meshgrid(corner[0] + steps, corner[1] + steps)
        sheet = np.zeros((east.size, 3))
        sheet[:, 0], sheet[:, 1] = east.ravel(), north.ravel()
        if self._ground is not None:
            sheet[:, 2] = self._ground.elevation_m(sheet[:, 0], sheet[:, 1])
        sheet[:, 2] += _SOFT_LIFT * side_m
        scene.skinvert.reshape(-1, 3)[self._rows] = sheet
        scene.skinnormal.reshape(-1, 3)[self._rows] = [0.0, 0.0, 1.0]


def add_sheet(spec: mujoco.MjSpec) -> None:
    """Prepare a model for a soft shadow."""
    texture = spec.add_texture(
        name=SHADE, type=mujoco.mjtTexture.mjTEXTURE_2D, width=_TEXELS, height=_TEXELS, nchannel=4
    )
    texture.data = bytes(_TEXELS * _TEXELS * 4)
    material = spec.add_material(name=SHADE, specular=0.0, shininess=0.0, emission=1.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = SHADE
    material.rgba = [1.0, 1.0, 1.0, 0.99]  # not opaque, so that the texture's alpha counts
    skin = spec.add_skin(name=SHADE, material=SHADE, rgba=material.rgba)
    column, row = np.meshgrid(np.arange(_GRID + 1), np.arange(_GRID + 1))
    corners = np.stack([column, row, np.zeros_like(row)], axis=-1).reshape(-1, 3) / _GRID
    first = (row[:-1, :-1] * (_GRID + 1) + column[:-1, :-1]).ravel()
    a, b, c, d = first, first + 1, first + _GRID + 1, first + _GRID + 2
    skin.vert = corners.ravel()
    skin.texcoord = corners[:, :2].ravel()
    skin.face = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)]).ravel().tolist()
    bind_to_world(skin, len(corners))


def bind_to_world(skin: mujoco.MjsSkin, corners: int) -> None:
    """Bind all corners of a skin to the world."""
    skin.bodyname = ["world"]
    skin.bindpos, skin.bindquat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    skin.vertid = [list(range(corners))]
    skin.vertweight = [[1.0] * corners]


def shade_picture(place: Floats) -> Image:
    """(128, 128, 4) shadow of points (P, 2) in the unit square, with a soft edge.

    Overlaps are not darker. The first row is at y = 0.
    """
    texel = np.clip((place * _TEXELS).astype(np.int64), 0, _TEXELS - 1)
    covered = np.zeros((_TEXELS, _TEXELS), dtype=bool)
    covered[texel[:, 1], texel[:, 0]] = True
    covered = binary_closing(covered, np.ones((3, 3), dtype=bool), iterations=2)
    soft = gaussian_filter(covered.astype(float), _SOFT)
    return dark(_LAYER * soft)


def dark(alpha: Floats) -> Image:
    """(H, W, 4) picture of a shadow with an opacity (H, W)."""
    picture = np.empty((*alpha.shape, 4), dtype=np.uint8)
    picture[..., :3] = np.rint(255.0 * DARK[:3])
    picture[..., 3] = np.rint(255.0 * alpha)
    return picture


def under_sun(points_m: Floats, ground: HeightField | None) -> Floats:
    """(P, 2) approximate ground points of the sun's rays through points (P, 3)."""
    slide = SUN_DIRECTION[:2] / -SUN_DIRECTION[2]
    level = np.zeros(len(points_m))
    if ground is not None:
        level = ground.elevation_m(points_m[:, 0], points_m[:, 1])
    height = np.clip(points_m[:, 2] - level, 0.0, None)
    return np.asarray(points_m[:, :2] + height[:, None] * slide)


def surface_points_m(corners_m: Floats, faces: Ints) -> Floats:
    """Points (P, 3) of a mesh that cover its surface: corners (V, 3) and middles of the faces."""
    return np.concatenate([corners_m, corners_m[faces].mean(axis=1)])


def link_surface_m(links_m: Floats, forward: Floats, robot: RobotConfig) -> Floats:
    """Points (P, 3) of links (L, 3) with axes (L, 3), drawn as the capsules of a robot."""
    half_m, radius_m = _half_sizes_m(robot, len(links_m))
    side = np.stack([-forward[:, 1], forward[:, 0], np.zeros(len(forward))], axis=1)
    along = links_m[:, None] + forward[:, None] * (half_m * np.linspace(-1.0, 1.0, 12))[:, None]
    across = radius_m[:, None] * np.linspace(-1.0, 1.0, 7)
    points = along[:, :, None] + (across[..., None] * side[:, None])[:, None]
    return points.reshape(-1, 3)


def _half_sizes_m(robot: RobotConfig, links: int) -> tuple[float, Floats]:
    """Half length of a drawn link, and radii (L,): thinner towards the tail."""
    thin = 1.0 - 0.5 * np.clip(np.linspace(0.0, 1.0, links) - 0.55, 0.0, None) / 0.45
    return 0.62 * robot.length_m / links, robot.body_radius_m * thin


def add_shade(
    scene: mujoco.MjvScene,
    links_m: Floats,
    forward: Floats,
    robot: RobotConfig,
    ground: HeightField | None,
) -> None:
    """Append one patch per link to an updated scene with enough free geoms.

    ``links_m`` (L, 3) are the centres of the links, ``forward`` (L, 3) their axes.
    """
    place, normal = _on_ground(links_m, ground)
    place = place + LIFT_M * normal
    ahead = forward - (forward * normal).sum(axis=1, keepdims=True) * normal
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    side = np.cross(normal, ahead)
    half_m, radius_m = _half_sizes_m(robot, len(links_m))
    for k in range(len(links_m)):
        size = np.array([half_m, radius_m[k], 0.001])
        axes = np.stack([ahead[k], side[k], normal[k]], axis=1).ravel()
        patch = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(patch, mujoco.mjtGeom.mjGEOM_ELLIPSOID, size, place[k], axes, DARK)
        scene.ngeom += 1


def _on_ground(links_m: Floats, ground: HeightField | None) -> tuple[Floats, Floats]:
    """Ground points of the sun's rays through (L, 3) points, and the normals (L, 3) there."""
    place = np.zeros_like(links_m)
    place[:, :2] = under_sun(links_m, ground)
    if ground is None:
        return place, np.tile([0.0, 0.0, 1.0], (len(links_m), 1))
    place[:, 2] = ground.elevation_m(place[:, 0], place[:, 1])
    east, north = ground.gradient(place[:, 0], place[:, 1])
    normal = np.stack([-east, -north, np.ones_like(east)], axis=1)
    return place, normal / np.linalg.norm(normal, axis=1, keepdims=True)
