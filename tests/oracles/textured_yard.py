"""A yard between walls, drawn by MuJoCo with real photographs as textures, seen by a stereo pair.

The photographs are pictures that scikit-image packs. Coordinates of a camera: x right, y down,
z forward.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Self

import cv2
import mujoco
import numpy as np
import skimage
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from snakewalk.sim.rendering.offscreen import Offscreen
from tests.oracles.ravine import Station

Array = NDArray[np.float64]
LENGTH_M, WIDTH_M, CELL_M = 9.0, 4.0, 0.02
RELIEF_M = 0.12
LOOKS = (
    ("ground", (6, 12), (1.0, 0.93, 0.82)),
    ("wall", (1, 6), (1.0, 0.75, 0.62)),
    ("boulder", (2, 2), (0.8, 1.0, 0.6)),
)
"""Surfaces with the tiles (down, across) and the tint of their photograph."""
CANVAS = 1.25
"""Size of the drawn picture in pictures of a lens with distortion, which shows parts outside."""


def _quilt(grey: NDArray[np.uint8], tiles: tuple[int, int], rng: np.random.Generator) -> Array:
    """Fill a surface with tiles of a photograph that are shifted by chance, so that none returns.

    Tiles overlap and blend over a sixteenth of their width.
    """
    size = 256
    grey = np.asarray(cv2.resize(grey, (512, 512), interpolation=cv2.INTER_AREA), np.uint8)
    edge = size // 16
    total = np.zeros((tiles[0] * size + edge, tiles[1] * size + edge))
    weight = np.full_like(total, 1e-9)
    ramp = np.minimum(
        1.0, np.minimum(np.arange(1, size + edge + 1), np.arange(size + edge, 0, -1)) / edge
    )
    for row in range(tiles[0]):
        for column in range(tiles[1]):
            shift = rng.integers(0, 512 - size - edge, 2)
            tile = grey[shift[0] : shift[0] + size + edge, shift[1] : shift[1] + size + edge]
            part = (
                slice(row * size, (row + 1) * size + edge),
                slice(column * size, (column + 1) * size + edge),
            )
            total[part] += np.outer(ramp, ramp) * tile
            weight[part] += np.outer(ramp, ramp)
    return np.asarray((total / weight)[: tiles[0] * size, : tiles[1] * size])


@dataclass(frozen=True)
class Yard:
    """A scene drawn by seed, with the camera that looks at it."""

    seed: int
    size_px: tuple[int, int] = (640, 480)
    focal_px: float = 460.0
    baseline_m: float = 0.12
    photographs: tuple[str, str, str] = ("gravel", "brick", "grass")
    """Of the ground, the walls and the boulders."""
    distortion: tuple[float, ...] = ()
    """Coefficients of the lens in OpenCV's order; none: a pinhole."""

    @classmethod
    def quarry(cls, seed: int) -> Self:
        """Return a scene of other photographs, seen through a wider lens with distortion."""
        return cls(
            seed, (560, 420), 380.0, 0.09, ("moon", "ihc", "coins"), (-0.18, 0.04, 4e-4, -3e-4)
        )

    @property
    def matrix(self) -> Array:
        """(3, 3) camera matrix."""
        wide, tall = self.size_px
        f = self.focal_px
        return np.array([[f, 0.0, 0.5 * (wide - 1)], [0.0, f, 0.5 * (tall - 1)], [0.0, 0.0, 1.0]])

    def heights(self) -> Array:
        """(rows, columns) heights of the ground every ``CELL_M`` from (-1, -2)."""
        rng = np.random.default_rng(self.seed)
        shape = (int(WIDTH_M / CELL_M) + 1, int(LENGTH_M / CELL_M) + 1)
        total = np.zeros(shape)
        for width, share in ((30.0, 1.0), (9.0, 0.25)):
            noise = gaussian_filter(rng.normal(size=shape), width)
            total += share * noise / noise.std()
        total -= total.min()
        return np.asarray(RELIEF_M * total / total.max())

    def height(self, x_m: Array, y_m: Array) -> Array:
        """Heights of the ground at places."""
        places = np.stack([(y_m + 0.5 * WIDTH_M) / CELL_M, (x_m + 1.0) / CELL_M])
        return np.asarray(map_coordinates(self.heights(), places, order=1, mode="nearest"))

    def stations(self, count: int) -> list[Station]:
        """Return left cameras on a winding way, 0.75 to 0.95 m apart."""
        rng = np.random.default_rng(self.seed + 1000)
        x_m, y_m, heading = 0.0, float(rng.uniform(-0.3, 0.3)), float(rng.uniform(-0.1, 0.1))
        stations = []
        for _ in range(count):
            tilt = 0.24 + float(rng.uniform(-0.04, 0.04))
            roll = float(rng.uniform(-0.03, 0.03))
            c, s, ct, st = np.cos(heading), np.sin(heading), np.cos(tilt), np.sin(tilt)
            forward, right = np.array([c * ct, s * ct, -st]), np.array([s, -c, 0.0])
            down = np.cross(forward, right)
            right, down = (
                np.cos(roll) * right + np.sin(roll) * down,
                np.cos(roll) * down - np.sin(roll) * right,
            )
            ground = float(self.height(np.array([x_m]), np.array([y_m]))[0])
            axes = np.column_stack([right, down, forward])
            stations.append(Station(np.array([x_m, y_m, ground + 0.45]), axes))
            step = float(rng.uniform(0.75, 0.95))
            x_m, y_m = x_m + step * np.cos(heading), y_m + step * np.sin(heading)
            heading = float(np.clip(-0.4 * y_m + rng.uniform(-0.12, 0.12), -0.3, 0.3))
        return stations

    def scene(self) -> "mujoco.MjModel":
        """Return the model: ground, two walls, an end and boulders."""
        rng = np.random.default_rng(self.seed + 2000)
        folder = Path(skimage.__file__).parent / "data"
        spec = mujoco.MjSpec()
        spec.visual.global_.offwidth, spec.visual.global_.offheight = self._canvas_px
        spec.visual.map.znear, spec.visual.map.zfar = 0.005, 10.0
        spec.visual.headlight.ambient = [0.55, 0.55, 0.55]
        spec.visual.headlight.diffuse = [0.35, 0.35, 0.35]
        spec.visual.headlight.specular = [0.0, 0.0, 0.0]
        for (name, tiles, tint), photograph in zip(LOOKS, self.photographs, strict=True):
            grey = np.asarray(cv2.imread(str(folder / f"{photograph}.png"), 0), np.uint8)
            grain = _quilt(grey, tiles, rng)
            colour = np.clip(grain[..., None] * np.array(tint), 0, 255).astype(np.uint8)
            texture = spec.add_texture(
                name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=colour.shape[1],
                height=colour.shape[0], nchannel=3,
            )  # fmt: skip
            texture.data = colour.tobytes()
            material = spec.add_material(name=name, specular=0.0)
            material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
        heights = self.heights()
        spec.add_hfield(
            name="ground", nrow=heights.shape[0], ncol=heights.shape[1],
            size=[0.5 * LENGTH_M, 0.5 * WIDTH_M, RELIEF_M, 0.1],
            userdata=(heights / RELIEF_M).ravel(),
        )  # fmt: skip
        middle = 0.5 * LENGTH_M - 1.0
        body = spec.worldbody
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="ground", pos=[middle, 0.0, 0.0],
            material="ground",
        )  # fmt: skip
        for side in (-1.0, 1.0):
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.5 * LENGTH_M, 0.05, 0.7],
                pos=[middle, side * 1.5, 0.7], material="wall",
            )  # fmt: skip
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.05, 2.0, 0.7], pos=[LENGTH_M - 1.2, 0.0, 0.7],
            material="wall",
        )  # fmt: skip
        for _ in range(7):
            size = rng.uniform(0.06, 0.2, 3)
            x_m, y_m = rng.uniform(0.8, 6.0), rng.uniform(0.45, 1.2) * rng.choice([-1.0, 1.0])
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_ELLIPSOID, size=size, pos=[x_m, y_m, 0.1],
                material="boulder",
            )  # fmt: skip
        return spec.compile()

    def pairs(self, stations: list[Station]) -> list[tuple[NDArray[np.uint8], NDArray[np.uint8]]]:
        """Return the left and right pictures of stations, with noise of 1.5 levels."""
        model = self.scene()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        rng = np.random.default_rng(self.seed + 3000)
        scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 1)
        scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        mujoco.mjv_updateScene(
            model, data, mujoco.MjvOption(), None, mujoco.MjvCamera(),
            mujoco.mjtCatBit.mjCAT_ALL, scene,
        )  # fmt: skip
        screen = Offscreen(model, *self._canvas_px)
        pairs = []
        for station in stations:
            pictures = []
            for shift_m in (0.0, self.baseline_m):
                self._aim(scene, station.at_m + shift_m * station.axes[:, 0], station.axes)
                drawn = self._through_lens(screen.draw(scene)).astype(float)
                drawn += rng.normal(0.0, 1.5, drawn.shape)
                pictures.append(np.clip(np.rint(drawn), 0, 255).astype(np.uint8))
            pairs.append((pictures[0], pictures[1]))
        screen.close()
        return pairs

    def reaches_m(self, at_m: Array, rays: Array) -> Array:
        """(n,) distances from a place to what the scene shows along rays (n, 3); NaN for the sky.

        Distances are in lengths of the rays.
        """
        model = self.scene()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        count = len(rays)
        length = np.linalg.norm(rays, axis=1)
        geom, reach = np.empty(count, np.int32), np.empty(count)
        rays_flat = np.ascontiguousarray(rays / length[:, None]).ravel()
        mujoco.mj_multiRay(
            model, data, at_m, rays_flat, None, True, -1, geom, reach, None, count, 60.0
        )
        return np.where(geom >= 0, reach / length, np.nan)

    @property
    def _canvas_px(self) -> tuple[int, int]:
        scale = CANVAS if self.distortion else 1.0
        return round(scale * self.size_px[0]), round(scale * self.size_px[1])

    def _through_lens(self, drawn: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the picture that the lens makes of the drawn one."""
        if not self.distortion:
            return drawn
        wide, tall = self.size_px
        u, v = np.meshgrid(np.arange(wide, dtype=float), np.arange(tall, dtype=float))
        seen = np.stack([u, v], axis=-1).reshape(-1, 1, 2)
        straight = cv2.undistortPoints(seen, self.matrix, np.array(self.distortion))
        middle = 0.5 * (np.array(self._canvas_px) - 1.0)
        place = (self.focal_px * straight.reshape(tall, wide, 2) + middle).astype(np.float32)
        return np.asarray(cv2.remap(drawn, place[..., 0], place[..., 1], cv2.INTER_CUBIC), np.uint8)

    def _aim(self, scene: "mujoco.MjvScene", at_m: Array, axes: Array) -> None:
        wide, tall = self._canvas_px
        near_m = 0.05
        scale = near_m / self.focal_px
        for camera in scene.camera:
            camera.pos, camera.forward, camera.up = at_m, axes[:, 2], -axes[:, 1]
            camera.frustum_center, camera.frustum_width = 0.0, 0.5 * wide * scale
            camera.frustum_bottom, camera.frustum_top = -0.5 * tall * scale, 0.5 * tall * scale
            camera.frustum_near, camera.frustum_far = near_m, 60.0
