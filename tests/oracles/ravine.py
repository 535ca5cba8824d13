"""A textured ravine as exact pictures: rays are cast against a height field, seen by a stereo pair.

The ravine runs along x between two walls. Coordinates of a camera: x right, y down, z forward.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Protocol, TypeVar

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
CELL_M = 0.01
X0_M, Y0_M = -1.0, -3.0
COLUMNS, ROWS = 1300, 600
FAR_M = 14.0
SKY = (196.0, 214.0, 232.0)

F = TypeVar("F")


def _compiled(function: F) -> F:
    made: F = numba.njit(cache=True)(function)
    return made


@_compiled
def _hash(i: int, j: int, k: int) -> float:
    n = (i * 374761393 + j * 668265263 + k * 2147483647) & 0xFFFFFFFF
    n = ((n ^ (n >> 13)) * 1274126177) & 0xFFFFFFFF
    n = ((n ^ (n >> 16)) * 2246822519) & 0xFFFFFFFF
    return ((n ^ (n >> 15)) & 0xFFFFFF) / 16777215.0


@_compiled
def _noise(x: float, y: float, z: float) -> float:
    """Value noise from 0 to 1 with a period of one unit."""
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    u, v, w = x - i, y - j, z - k
    u, v, w = u * u * (3 - 2 * u), v * v * (3 - 2 * v), w * w * (3 - 2 * w)
    i, j, k = int(i), int(j), int(k)
    total = 0.0
    for a in range(2):
        for b in range(2):
            for c in range(2):
                share = (u if a else 1 - u) * (v if b else 1 - v) * (w if c else 1 - w)
                total += share * _hash(i + a, j + b, k + c)
    return total


@_compiled
def _heights(z: Array) -> None:
    for row in range(z.shape[0]):
        for column in range(z.shape[1]):
            x, y = X0_M + column * CELL_M, Y0_M + row * CELL_M
            middle = 0.22 * math.sin(0.8 * x) + 0.1 * math.sin(2.1 * x + 1.0)
            half = 0.55 + 0.12 * math.sin(1.3 * x + 0.5)
            steep = min(max((abs(y - middle) - half) / 0.35, 0.0), 1.0)
            end = min(max((x - 10.0) / 1.0, 0.0), 1.0)
            wall = max(steep * steep * (3 - 2 * steep), end)
            rough = _noise(2.5 * x, 2.5 * y, 7.0) - 0.5 + 0.4 * (_noise(7 * x, 7 * y, 3.0) - 0.5)
            ledge = _noise(1.1 * x, 1.1 * y, 11.0)
            z[row, column] = wall * (0.9 + 0.9 * ledge + 0.35 * rough) + 0.09 * rough


@_compiled
def _height(z: Array, x: float, y: float) -> float:
    u, v = (x - X0_M) / CELL_M, (y - Y0_M) / CELL_M
    u, v = min(max(u, 0.0), z.shape[1] - 1.001), min(max(v, 0.0), z.shape[0] - 1.001)
    i, j = int(u), int(v)
    fu, fv = u - i, v - j
    low = (1 - fu) * z[j, i] + fu * z[j, i + 1]
    return float((1 - fv) * low + fv * ((1 - fu) * z[j + 1, i] + fu * z[j + 1, i + 1]))


@_compiled
def _reach(z: Array, at: Array, ray: Array) -> float:
    """Distance along the ray to the ground; NaN if it meets none."""
    near, far = 0.02, 0.02
    while far < FAR_M:
        gap = at[2] + far * ray[2] - _height(z, at[0] + far * ray[0], at[1] + far * ray[1])
        if gap <= 0.0:
            for _ in range(20):
                middle = 0.5 * (near + far)
                x, y = at[0] + middle * ray[0], at[1] + middle * ray[1]
                if at[2] + middle * ray[2] > _height(z, x, y):
                    near = middle
                else:
                    far = middle
            return 0.5 * (near + far)
        near = far
        far += max(0.003 + 0.0015 * far, 0.2 * gap)
    return math.nan


@_compiled
def _colour(z: Array, x: float, y: float, up: float, out: Array) -> None:
    grain = 0.0
    weight = 0.0
    for octave in range(7):
        scale, share = 3.0 * 2.0**octave, 0.9**octave
        grain += share * _noise(scale * x, scale * y, scale * up + 31 * octave)
        weight += share
    grain = 3.0 * (grain / weight - 0.5)
    strata = 0.5 * math.sin(26.0 * up + 3.0 * _noise(1.5 * x, 1.5 * y, 0.0))
    moss = _noise(1.7 * x, 1.7 * y, 1.7 * up + 5.0)
    slope_x = (_height(z, x + 0.01, y) - _height(z, x - 0.01, y)) / 0.02
    slope_y = (_height(z, x, y + 0.01) - _height(z, x, y - 0.01)) / 0.02
    light = (0.85 - 0.25 * slope_x + 0.35 * slope_y) / math.sqrt(1 + slope_x**2 + slope_y**2)
    light = 0.35 + 0.65 * min(max(light, 0.0), 1.0)
    level = (0.62 + 0.42 * grain + 0.1 * strata) * light
    green = min(max(3.0 * (moss - 0.6), 0.0), 1.0) * 0.6
    out[0] += 255.0 * level * ((1 - green) * 0.95 + green * 0.55)
    out[1] += 255.0 * level * ((1 - green) * 0.80 + green * 0.75)
    out[2] += 255.0 * level * ((1 - green) * 0.62 + green * 0.35)


@_compiled
def _cast(
    z: Array, at: Array, axes: Array, lens: Array, fine: int, picture: Array, depth: Array
) -> None:
    """Write colours (H, W, 3), the mean of ``fine`` by ``fine`` rays, and depths of the middles."""
    ray, colour = np.empty(3), np.empty(3)
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            colour[:] = 0.0
            for part in range(-1, fine * fine):
                du, dv = 0.0, 0.0
                if part >= 0:
                    du, dv = (part % fine + 0.5) / fine - 0.5, (part // fine + 0.5) / fine - 0.5
                x, y = (column + du - lens[1]) / lens[0], (row + dv - lens[2]) / lens[0]
                for k in range(3):
                    ray[k] = axes[k, 0] * x + axes[k, 1] * y + axes[k, 2]
                reach = _reach(z, at, ray)
                if part < 0:
                    depth[row, column] = reach
                elif math.isnan(reach):
                    for k in range(3):
                        colour[k] += SKY[k]
                else:
                    place = at + reach * ray
                    _colour(z, place[0], place[1], place[2], colour)
            for k in range(3):
                picture[row, column, k] = min(max(colour[k] / fine**2, 0.0), 255.0)


@_compiled
def _reaches(z: Array, at: Array, rays: Array, out: Array) -> None:
    for number in range(len(rays)):
        out[number] = _reach(z, at, rays[number])


def reaches_m(at_m: Array, rays: Array) -> Array:
    """(n,) distances from a place to the ground along rays (n, 3), in lengths of the rays."""
    out = np.empty(len(rays))
    _reaches(heights(), at_m, np.ascontiguousarray(rays), out)
    return out


@cache
def heights() -> Array:
    """(rows, columns) heights every ``CELL_M`` from (``X0_M``, ``Y0_M``)."""
    z = np.zeros((ROWS, COLUMNS))
    _heights(z)
    return z


@dataclass(frozen=True)
class Station:
    """Left camera of a position."""

    at_m: Array
    axes: Array
    """(3, 3) columns: right, down, forward in the world."""

    @property
    def pose(self) -> Array:
        """(3, 4) from the camera to the world."""
        return np.column_stack([self.axes, self.at_m])


def station(x_m: float, turn_rad: float = 0.0, tilt_rad: float = 0.22) -> Station:
    """Camera 0.5 m above the bed of the ravine, that looks along it; positive turns are left."""
    y_m = 0.22 * math.sin(0.8 * x_m) + 0.1 * math.sin(2.1 * x_m + 1.0)
    ahead = 0.22 * 0.8 * math.cos(0.8 * x_m)
    heading = 0.6 * math.atan(ahead) + turn_rad
    c, s = math.cos(heading), math.sin(heading)
    ct, st = math.cos(tilt_rad), math.sin(tilt_rad)
    forward, right = np.array([c * ct, s * ct, -st]), np.array([s, -c, 0.0])
    axes = np.column_stack([right, np.cross(forward, right), forward])
    return Station(np.array([x_m, y_m, 0.5]), axes)


class Lens(Protocol):
    """Both cameras of a pair, without distortion."""

    @property
    def matrix(self) -> Array:
        """(3, 3) camera matrix, pixels."""
        ...

    @property
    def baseline_m(self) -> float:
        """Distance of the cameras."""
        ...


@dataclass(frozen=True)
class Camera:
    """Both cameras of a pair."""

    size_px: tuple[int, int] = (480, 360)
    focal_px: float = 400.0
    baseline_m: float = 0.1

    @property
    def matrix(self) -> Array:
        """(3, 3)."""
        wide, tall = self.size_px
        f = self.focal_px
        return np.array([[f, 0.0, 0.5 * (wide - 1)], [0.0, f, 0.5 * (tall - 1)], [0.0, 0.0, 1.0]])

    def look(
        self, at: Station, shift_m: float = 0.0, fine: int = 2
    ) -> tuple[NDArray[np.uint8], Array]:
        """(H, W, 3) picture, red first, and (H, W) depths; NaN for the sky."""
        wide, tall = self.size_px
        picture, depth = np.empty((tall, wide, 3)), np.empty((tall, wide))
        lens = np.array([self.focal_px, self.matrix[0, 2], self.matrix[1, 2]])
        place = at.at_m + shift_m * at.axes[:, 0]
        axes = np.ascontiguousarray(at.axes)
        _cast(heights(), place, axes, lens, fine, picture, depth)
        return np.rint(picture).astype(np.uint8), depth

    def pair(
        self, at: Station, seed: int = 0, noise: float = 1.5, fine: int = 2
    ) -> tuple[NDArray[np.uint8], ...]:
        """Left and right pictures with a sensor's noise."""
        random = np.random.default_rng(seed)
        pictures = []
        for shift in (0.0, self.baseline_m):
            drawn = self.look(at, shift, fine)[0] + random.normal(
                0.0, noise, (*self.size_px[::-1], 3)
            )
            pictures.append(np.clip(np.rint(drawn), 0, 255).astype(np.uint8))
        return tuple(pictures)


def write_route(
    folder: Path, places_m: Sequence[float], camera: Camera = Camera(), fine: int = 2
) -> Path:
    """Write pictures, calibration and positions of a walk; return the positions' file."""
    stations = [station(x_m) for x_m in places_m]
    pairs = [camera.pair(at, number, fine=fine) for number, at in enumerate(stations)]
    return write_positions(folder, camera, stations, pairs)


def write_positions(
    folder: Path,
    camera: Lens,
    stations: Sequence[Station],
    pairs: Sequence[tuple[NDArray[np.uint8], ...]],
    distortion: Sequence[float] = (),
) -> Path:
    """Write pictures, calibration and true poses; return the positions' file.

    A lens with ``distortion`` has a calibration with OpenCV's names.
    """
    if distortion:
        one = {"K": camera.matrix.tolist(), "D": list(distortion)}
        both = {f"{name}{side}": value for side in (1, 2) for name, value in one.items()}
        both |= {"R": np.eye(3).tolist(), "T": [-camera.baseline_m, 0.0, 0.0]}
        name = "calib.json"
        (folder / name).write_text(json.dumps(both))
    else:
        rows = [f"{value:g}" for value in camera.matrix.ravel()]
        matrix = "[" + "; ".join(" ".join(rows[i : i + 3]) for i in (0, 3, 6)) + "]"
        name = "calib.txt"
        (folder / name).write_text(
            f"cam0={matrix}\ncam1={matrix}\nbaseline={1000 * camera.baseline_m:g}\n"
        )
    lines = [f'calibration = "{name}"', "disparities = 128"]
    for number, (at, pair) in enumerate(zip(stations, pairs, strict=True)):
        lines += ["", "[[positions]]"]
        for side, picture in zip(("left", "right"), pair, strict=True):
            name = f"{number}-{side}.png"
            cv2.imwrite(str(folder / name), picture[..., ::-1])
            lines.append(f'{side} = "{name}"')
        lines.append(f"pose = {np.round(at.pose, 6).tolist()}")
    file = folder / "positions.toml"
    file.write_text("\n".join(lines) + "\n")
    return file
