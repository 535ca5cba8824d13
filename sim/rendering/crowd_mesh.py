"""Meshes of many bodies at several levels of detail, and their shadows, in few draw calls.

A body is a tube around its centre line: ``rings`` x ``sides`` corners. All bodies of one kind and
level are one MuJoCo skin; only the faces in use are drawn.
"""

from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from snakewalk.config.arrays import Floats, Image, Ints
from snakewalk.config.heightfield import HeightField
from snakewalk.sim.rendering.looks import EYE, PUPIL, Rgba
from snakewalk.sim.rendering.shade import DARK, bind_to_world, dark, under_sun

MESHES = ((7, 4), (13, 6), (33, 12))
"""Rings and sides of a body at each level, farthest first (ours)."""
COLOURS: tuple[tuple[Rgba, Rgba], ...] = (
    ((0.80, 0.56, 0.20, 1), (0.36, 0.22, 0.11, 1)),
    ((0.42, 0.55, 0.24, 1), (0.20, 0.27, 0.12, 1)),
    ((0.62, 0.30, 0.22, 1), (0.28, 0.13, 0.10, 1)),
    ((0.45, 0.50, 0.56, 1), (0.20, 0.22, 0.26, 1)),
    ((0.86, 0.76, 0.48, 1), (0.55, 0.40, 0.18, 1)),
)
"""Back and bands of five kinds of animals (ours)."""
_TEXTURE = (256, 32)
"""Texels along and around half of a body."""
_BANDS = 5
_HEAD = 0.05
"""Share of the body in which the head is round."""
_EYE = (0.035, 0.27)
"""Place of an eye: along the body, and from back to belly."""
_NOSE = 0.4
_TAIL = 3.0
"""Length of the tips beyond the centre line's ends, radii there (ours)."""
_SHADOW_RINGS = 13
_SHADOW_LIFT_M = 0.006
"""Height of a shadow above the ground, so that the two do not flicker into each other."""
_SHADOW_WIDTH = 1.7
"""Half width of a shadow with its soft edge, radii of the body."""


@dataclass(frozen=True, slots=True)
class TubeGrid:
    """Rings along a body and sides around it; the same arrays for every body."""

    rings: int
    sides: int

    @property
    def corners(self) -> int:
        """Number of corners of a body."""
        return self.rings * self.sides

    @property
    def faces(self) -> Ints:
        """(F, 3) triangles of one body."""
        ring, side = np.meshgrid(np.arange(self.rings - 1), np.arange(self.sides), indexing="ij")
        a, b = ring * self.sides + side, ring * self.sides + (side + 1) % self.sides
        c, d = a + self.sides, b + self.sides
        both = np.stack([np.stack([a, b, c], -1), np.stack([b, d, c], -1)], axis=2)
        return both.reshape(-1, 3)

    @property
    def uv(self) -> Floats:
        """(V, 2): 0 at the head to 1 at the tail, and 0 on the back to 1 on the belly."""
        along, round_rad = np.meshgrid(
            _places_along_body(self.rings), self._round_rad(), indexing="ij"
        )
        belly = np.abs(np.arctan2(np.sin(round_rad), np.cos(round_rad))) / np.pi
        return np.stack([along, belly], axis=-1).reshape(-1, 2)

    def tubes(self, points_m: Floats, radius_m: Floats) -> tuple[Floats, Floats]:
        """(B, V, 3) corners and normals of bodies with centre lines (B, n, 3) and radii (B, n)."""
        place, slope = _spline(points_m.shape[1], self.rings)
        centre = place @ points_m
        ahead = -_unit(slope @ points_m)
        radius = radius_m @ place.T
        along = _places_along_body(self.rings)
        bulge = np.minimum(along / _HEAD, 1.0) ** 0.5 * np.minimum((1.0 - along) / 0.2, 1.0) ** 0.7
        centre[:, 0] += _NOSE * radius[:, :1] * ahead[:, 0]
        centre[:, -1] -= _TAIL * radius[:, -1:] * ahead[:, -1]
        side = _unit(np.cross([0.0, 0.0, 1.0], ahead))
        up = np.cross(ahead, side)
        angle = self._round_rad()
        normal = np.cos(angle)[:, None] * up[:, :, None] + np.sin(angle)[:, None] * side[:, :, None]
        corner = centre[:, :, None] + (bulge * radius)[:, :, None, None] * normal
        normal[:, 0], normal[:, -1] = ahead[:, :1], -ahead[:, -1:]
        count = len(points_m)
        corners: Floats = np.asarray(corner, float).reshape(count, -1, 3)
        return corners, np.asarray(normal, float).reshape(count, -1, 3)

    def _round_rad(self) -> Floats:
        return np.arange(self.sides, dtype=float) * (2.0 * np.pi / self.sides)


class CrowdMeshes:
    """Skins of one model for all bodies of a frame; ``add_to`` prepares the model."""

    def __init__(self, bodies: int) -> None:
        """Reserve memory for ``bodies`` at any level."""
        self._bodies = bodies
        self._capacity = -(-bodies // len(COLOURS))
        self._grids = tuple(TubeGrid(*mesh) for mesh in MESHES)
        self._ribbon = _ribbon_faces(), _ribbon_uv()

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add skins and textures to an uncompiled model."""
        for kind, (back, band) in enumerate(COLOURS):
            _material(spec, f"crowd{kind}", _banded_texture(back, band), alpha=False)
            for level, grid in enumerate(self._grids):
                _skin(
                    spec,
                    f"crowd{kind}-{level}",
                    f"crowd{kind}",
                    grid.faces,
                    grid.uv,
                    self._capacity,
                )
        _material(spec, "crowd-shadow", _soft_edge(), alpha=True)
        _skin(spec, "crowd-shadow", "crowd-shadow", *self._ribbon, self._bodies)

    def lay(
        self,
        model: mujoco.MjModel,
        scene: mujoco.MjvScene,
        bodies: list[tuple[int, int, Floats, Floats]],
        ground: HeightField,
    ) -> None:
        """Lay bodies and their shadows into an updated scene with enough free geoms.

        ``bodies`` are colour number, level from 0, centre line (n, 3), radius (n,). Bodies of one
        level have equally many points. ``ground`` catches the shadows.
        """
        groups: dict[tuple[int, int], list[tuple[Floats, Floats]]] = {}
        for kind, level, points, radius in bodies:
            groups.setdefault((kind % len(COLOURS), level), []).append((points, radius))
        for (kind, level), group in groups.items():
            points_m, radius_m = (np.stack(column) for column in zip(*group, strict=True))
            corner, normal = self._grids[level].tubes(points_m, radius_m)
            _draw(model, scene, f"crowd{kind}-{level}", corner, normal)
        if bodies:
            shadows = np.stack(
                [
                    _spline(len(points), _SHADOW_RINGS)[0] @ np.column_stack([points, radius])
                    for _, _, points, radius in bodies
                ]
            )
            flat = _shadow_corners(shadows, ground)
            _draw(model, scene, "crowd-shadow", flat, np.broadcast_to([0.0, 0.0, 1.0], flat.shape))


def _places_along_body(rings: int) -> Floats:
    """(rings,) places along a body, denser at its ends."""
    even = np.linspace(0.0, 1.0, rings)
    return even - 0.6 * np.sin(2.0 * np.pi * even) / (2.0 * np.pi)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


@lru_cache(maxsize=16)
def _spline(points: int, rings: int) -> tuple[Floats, Floats]:
    """(rings, points) weights of points in a cubic spline and its slopes."""
    line = CubicSpline(np.linspace(0.0, 1.0, points), np.eye(points))
    return line(_places_along_body(rings)), line(_places_along_body(rings), 1)


def _shadow_corners(lines: Floats, ground: HeightField) -> Floats:
    """(B, 2 rings, 3) corners on the ground of shadows with lines (B, rings, 4)."""
    count = len(lines)
    place = under_sun(lines[..., :3].reshape(-1, 3), ground).reshape(count, -1, 2)
    ahead = np.gradient(place, axis=1)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=2, keepdims=True), 1e-12)
    left = np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1)
    half = _SHADOW_WIDTH * lines[..., 3:]
    sides = np.stack([place + half * left, place - half * left], axis=2).reshape(count, -1, 2)
    height = ground.elevation_m(sides[..., 0], sides[..., 1]) + _SHADOW_LIFT_M
    return np.concatenate([sides, height[..., None]], axis=2)


def _ribbon_faces() -> Ints:
    a = 2 * np.arange(_SHADOW_RINGS - 1)
    both = np.stack([np.stack([a, a + 1, a + 2], 1), np.stack([a + 2, a + 1, a + 3], 1)], axis=1)
    return both.reshape(-1, 3)


def _ribbon_uv() -> Floats:
    along = np.repeat(np.linspace(0.0, 1.0, _SHADOW_RINGS), 2)
    return np.column_stack([along, np.tile([0.0, 1.0], _SHADOW_RINGS)])


def _banded_texture(back: Rgba, band: Rgba) -> Image:
    """(H, W, 3) texture: bands across a back, a paler belly, and eyes."""
    wide, high = _TEXTURE
    along, belly = np.meshgrid(np.linspace(0.0, 1.0, wide), np.linspace(0.0, 1.0, high))
    dark = (np.mod(_BANDS * along + 0.35, 1.0) < 0.28) & (belly < 0.75) & (along > 0.08)
    colour = np.where(dark[..., None], band[:3], back[:3])
    from_eye = np.hypot((along - _EYE[0]) / 0.014, (belly - _EYE[1]) / 0.11)
    colour[from_eye < 1.0] = EYE[:3]
    colour[from_eye < 0.55] = PUPIL[:3]
    pale = 0.55 * np.clip((belly - 0.6) / 0.2, 0.0, 1.0)[..., None]
    return np.asarray(np.rint(255.0 * (colour + pale * (0.95 - colour))), dtype=np.uint8)


def _soft_edge() -> Image:
    """(H, W, 4) shadow texture: dark in its middle, clear at its edges and ends."""
    wide, high = _TEXTURE
    along, across = np.meshgrid(np.linspace(0.0, 1.0, wide), np.linspace(-1.0, 1.0, high))
    soft = np.clip(1.6 * (1.0 - np.abs(across)), 0.0, 1.0)
    soft *= np.clip(14.0 * np.minimum(along, 1.0 - along), 0.0, 1.0)
    return dark(1.5 * DARK[3] * soft)


def _material(spec: mujoco.MjSpec, name: str, picture: Image, *, alpha: bool) -> None:
    high, wide, channels = picture.shape
    texture = spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=wide, height=high, nchannel=channels
    )
    texture.data = picture.tobytes()
    material = spec.add_material(name=name, specular=0.0 if alpha else 0.2, shininess=0.3)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    if alpha:
        material.emission = 1.0
        material.rgba = [1.0, 1.0, 1.0, 0.99]  # not opaque, so that the texture's alpha counts


def _skin(
    spec: mujoco.MjSpec, name: str, material: str, faces: Ints, uv: Floats, capacity: int
) -> None:
    """Add a skin for several copies of a mesh."""
    corners = len(uv)
    skin = spec.add_skin(name=name, material=material, rgba=[1.0, 1.0, 1.0, 1.0])
    shift = corners * np.arange(capacity)[:, None, None]
    skin.face = (faces[None] + shift).ravel().tolist()
    skin.vert = np.tile(np.column_stack([uv, np.zeros(corners)]), (capacity, 1)).ravel()
    skin.texcoord = np.tile(uv, (capacity, 1)).ravel()
    bind_to_world(skin, corners * capacity)


def _draw(
    model: mujoco.MjModel, scene: mujoco.MjvScene, name: str, corner: Floats, normal: Floats
) -> None:
    """Fill the first places of a skin with meshes (B, V, 3), and add it to the scene."""
    skin = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SKIN, name)
    start = int(model.skin_vertadr[skin])
    used = corner.shape[0] * corner.shape[1]
    capacity = int(model.skin_vertnum[skin]) // corner.shape[1]
    scene.skinvert.reshape(-1, 3)[start : start + used] = corner.reshape(-1, 3)
    scene.skinnormal.reshape(-1, 3)[start : start + used] = normal.reshape(-1, 3)
    scene.skinfacenum[skin] = int(model.skin_facenum[skin]) // capacity * corner.shape[0]
    geom = scene.geoms[scene.ngeom]
    material = int(model.skin_matid[skin])
    mujoco.mjv_initGeom(
        geom,
        mujoco.mjtGeom.mjGEOM_SKIN,
        np.zeros(3),
        corner.reshape(-1, 3).mean(axis=0),
        np.eye(3).ravel(),
        model.mat_rgba[material],
    )
    geom.objtype = mujoco.mjtObj.mjOBJ_SKIN
    geom.objid = skin
    geom.matid = material
    geom.texcoord = 1
    geom.specular = model.mat_specular[material]
    geom.shininess = model.mat_shininess[material]
    geom.emission = model.mat_emission[material]
    geom.transparent = int(model.mat_rgba[material, 3] < 1.0)
    scene.ngeom += 1
