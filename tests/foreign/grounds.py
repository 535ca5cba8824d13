"""Files of elevations: units, axes, void values, scales; and what is correct."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import rasterio
import trimesh
from rasterio.crs import CRS
from rasterio.transform import Affine, from_origin

from snakewalk.config.reading import Facts
from snakewalk.controller.mapping.elevation_choice import ElevationChoice
from snakewalk.controller.mapping.elevation_file import MapOptions, read_elevation
from tests.controller.mapping.test_las_file import write as las
from tests.foreign.case import Case, Values

ROWS, COLUMNS, STEP_M = 30, 41, 2.0
X, Y = np.meshgrid(np.arange(COLUMNS) * STEP_M, np.arange(ROWS) * STEP_M)
HILL = 100.0 + 0.05 * X + 0.03 * Y + 3.0 * np.exp(-((X - 50.0) ** 2 + (Y - 15.0) ** 2) / 90.0)
"""(ROWS, COLUMNS) heights in metres, row 0 in the south."""
POINTS = np.stack([X.ravel(), Y.ravel(), HILL.ravel()], axis=1)
FAR_M = np.array([500000.0, 4500000.0, 0.0])
FOOT_M, US_FOOT_M = 0.3048, 1200.0 / 3937.0
UTM = "EPSG:26917"
Write = Callable[[Path], Path]
RIGHT = {
    "wide_m": (COLUMNS - 1) * STEP_M,
    "deep_m": (ROWS - 1) * STEP_M,
    "relief_m": float(np.ptp(HILL)),
    "turned_m": 0.0,
    "holes": 0,
}


def read(file: Path, options: dict[str, Any]) -> tuple[Values, Facts]:
    given = dict(options)
    spacing_m = given.pop("spacing_m", None)
    found = read_elevation(file, MapOptions(ElevationChoice(**given), spacing_m=spacing_m))
    z_m = found.elevation.z_m
    wide_m, deep_m = found.size_m
    values = {
        "wide_m": wide_m,
        "deep_m": deep_m,
        "relief_m": found.relief_m,
        "holes": int(np.isnan(z_m).sum()),
    }
    if z_m.shape == HILL.shape:
        per_m = found.relief_m / np.ptp(HILL)
        away_m = z_m - np.nanmin(z_m) - per_m * (HILL - HILL.min())
        error_m = float(np.nanmax(np.abs(away_m)))
        values["turned_m"] = 0.0 if error_m < 0.02 * found.relief_m else error_m
    else:
        values["turned_m"] = 0.0 if spacing_m else np.inf
    return values, found.facts


def tif(
    *, crs: Any = UTM, unit: str = "", cell: float = STEP_M, size: float = 1.0,
    scale: tuple[float, float] = (1.0, 0.0), nodata: float | None = None, void: float | None = None,
    south: bool = False, kind: str = "float32", bands: int = 1, origin: tuple[float, float] =
    (500000.0, 4500000.0), colours: Any = None, **more: Any,
) -> Write:  # fmt: skip
    def write(folder: Path) -> Path:
        values = (size * HILL[::-1] - scale[1]) / scale[0]
        values = np.rint(values) if np.dtype(kind).kind in "iu" else values
        if void is not None:
            values[3, 5:9] = void
        where = from_origin(*origin, cell, cell)
        if south:
            values, where = values[::-1], Affine(cell, 0, origin[0], 0, cell, origin[1])
        file = folder / "a.tif"
        with rasterio.open(
            file, "w", driver="GTiff", height=ROWS, width=COLUMNS, count=bands, dtype=kind,
            crs=crs, transform=where, nodata=nodata, **more,
        ) as out:  # fmt: skip
            for band in range(bands):
                out.write(values.astype(kind), band + 1)
            if unit:
                out.units = [unit] * bands
            if scale != (1.0, 0.0):
                out.scales, out.offsets = [scale[0]] * bands, [scale[1]] * bands
            if colours == "palette":
                out.write_colormap(1, {k: (k, k, k, 255) for k in range(256)})
        return file

    return write


def grid(head: dict[str, Any], void: float | None = None, size: float = 1.0) -> Write:
    def write(folder: Path) -> Path:
        values = size * HILL[::-1]
        if void is not None:
            values[3, 5:9] = void
        about = {"ncols": COLUMNS, "nrows": ROWS} | head
        lines = [f"{key} {value}" for key, value in about.items()]
        lines += [" ".join(f"{v:.6f}" for v in row) for row in values]
        (folder / "a.asc").write_text("\n".join(lines) + "\n")
        return folder / "a.asc"

    return write


def table(
    name: str, header: str = "", separator: str = " ", comma: bool = False,
    points: np.ndarray = POINTS, void: str = "", digits: int = 9,
) -> Write:  # fmt: skip
    def write(folder: Path) -> Path:
        rows = [[f"{v:.{digits}f}" for v in row] for row in points]
        if void:
            for row in rows[40:44]:
                row[2] = void
        if comma:
            rows = [[cell.replace(".", ",") for cell in row] for row in rows]
        lines = [*([header] if header else []), *(separator.join(row) for row in rows)]
        (folder / name).write_text("\n".join(lines) + "\n")
        return folder / name

    return write


def degrees(latitude: float, longitude: float) -> np.ndarray:
    """Points in longitude, latitude (WGS 84) and metres."""
    sine = np.sin(np.radians(latitude)) ** 2
    a_m, e2 = 6378137.0, 0.00669437999014
    north_m = np.radians(a_m * (1 - e2) / (1 - e2 * sine) ** 1.5)
    east_m = np.radians(a_m / np.sqrt(1 - e2 * sine) * np.cos(np.radians(latitude)))
    x, y, z = POINTS.T
    y = y - y.mean()
    return np.stack([longitude + x / east_m, latitude + y / north_m, z], axis=1)


def solid(name: str, points: np.ndarray = POINTS, cloud: bool = False) -> Write:
    def write(folder: Path) -> Path:
        cell = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
        a, b, c, d = (cell[i, j].ravel() for i, j in (
            (np.s_[:-1], np.s_[:-1]), (np.s_[:-1], np.s_[1:]), (np.s_[1:], np.s_[1:]),
            (np.s_[1:], np.s_[:-1])))  # fmt: skip
        faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
        made = (
            trimesh.PointCloud(points) if cloud else trimesh.Trimesh(points, faces, process=False)
        )
        made.export(folder / name)
        return folder / name

    return write


def pcd(folder: Path) -> Path:
    head = f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(POINTS)}\n"
    head += f"HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(POINTS)}\nDATA ascii\n"
    (folder / "a.pcd").write_text(head + "\n".join(" ".join(map(str, row)) for row in POINTS))
    return folder / "a.pcd"


def laser(points: np.ndarray = POINTS, **options: Any) -> Write:
    def write(folder: Path) -> Path:
        return las(folder / "a.las", points, **options)

    return write


def plain(name: str, values: Any) -> Write:
    def write(folder: Path) -> Path:
        file = folder / name
        if name.endswith(".png"):
            cv2.imwrite(str(file), np.rint(100 * HILL[::-1]).astype(np.uint16))
        elif name.endswith(".npz"):
            np.savez(file, elevation=values)
        else:
            file.write_text("\n".join(",".join(f"{v:.6f}" for v in row) for row in values))
        return file

    return write


def cases() -> Iterator[Case]:
    """Yield the cases."""

    def case(kind: str, statement: str, write: Write, answer: Any = RIGHT, **options: Any) -> Case:
        return Case(kind, statement, write, read, answer, options)

    def sized(factor: float, rise: float = 1.0) -> Values:
        size = {key: factor * RIGHT[key] for key in ("wide_m", "deep_m")}
        return RIGHT | size | {"relief_m": rise * RIGHT["relief_m"]}

    holes = RIGHT | {"holes": 4}
    for unit, size in (
        ("m", 1.0), ("metre", 1.0), ("ft", 1 / FOOT_M), ("feet", 1 / FOOT_M),
        ("US survey foot", 1 / US_FOOT_M), ("us-ft", 1 / US_FOOT_M), ("cm", 100.0), ("mm", 1e3),
        ("km", 1e-3),
    ):  # fmt: skip
        kind = "float64" if unit == "km" else "float32"
        yield case("geotiff", f"heights in {unit}", tif(unit=unit, size=size, kind=kind))
    yield case("geotiff", "no unit of heights, cells in m", tif())
    yield case("geotiff", "an unknown unit of heights", tif(unit="fathom"), "--height-unit")
    yield case("geotiff", "an unknown unit, --height-unit", tif(unit="fathom"), height_unit="m")
    feet = CRS.from_epsg(2272)  # Pennsylvania South, US survey feet
    state = {"crs": feet, "cell": STEP_M / US_FOOT_M, "origin": (2000000.0, 500000.0)}
    yield case("geotiff", "cells in feet, no unit of heights", tif(**state), "--height-unit us-ft")
    yield case("geotiff", "cells in feet, heights in feet",
               tif(**state, unit="us-ft", size=1 / US_FOOT_M))  # fmt: skip
    yield case("geotiff", "cells in feet, heights in m", tif(**state, unit="m"))
    for scale in ((0.01, 0.0), (0.01, 50.0), (2.0, -20.0), (-0.1, 300.0)):
        words = f"scale {scale[0]:g}, offset {scale[1]:g}"
        yield case("geotiff", words, tif(scale=scale, unit="m"))
    for kind, size in (("float64", 1.0), ("int16", 100.0), ("uint16", 100.0), ("int32", 1e3)):
        made = tif(kind=kind, unit={1.0: "m", 100.0: "cm", 1e3: "mm"}[size], size=size)
        yield case("geotiff", f"values of type {kind}", made)
    for void in (-9999.0, -32768.0, 3.4e38, 1e20):
        kind = {"nodata": void, "void": void, "unit": "m"}
        yield case("geotiff", f"nodata {void:g}", tif(**kind), holes)
    for void in (-9999.0, -32767.0, 9999.0):
        write = tif(void=void, unit="m")
        yield case("geotiff", f"void {void:g} without a tag", write, "--no-data")
        yield case("geotiff", f"void {void:g}, --no-data", write, holes, no_data=void)
    yield case("geotiff", "rows from the south", tif(south=True, unit="m"))
    yield case("geotiff", "two bands", tif(bands=2, unit="m"))
    palette = tif(kind="uint8", colours="palette")
    yield case("geotiff", "a palette", palette, "values are classes, not heights")
    rgb = tif(kind="uint8", bands=3, photometric="RGB")
    yield case("geotiff", "red, green, blue of 8 bits", rgb, "picture")
    deep = tif(kind="uint16", bands=3, photometric="RGB")
    yield case("geotiff", "red, green, blue of 16 bits", deep, "a picture, not heights")
    for crs in ("EPSG:32632", "EPSG:25833", "EPSG:2056"):
        origin = (2600000.0, 1200000.0) if crs == "EPSG:2056" else (500000.0, 4500000.0)
        yield case("geotiff", f"system {crs}", tif(crs=crs, origin=origin, unit="m"))
    mercator = CRS.from_epsg(3857)
    stretch = 1.0 / np.cos(np.radians(50.0))
    spot = (1000000.0, 6446275.0)
    wide = tif(crs=mercator, cell=STEP_M * stretch, origin=spot, unit="m")
    yield case("geotiff", "Web Mercator at 50 degrees", wide,
               {"relief_m": RIGHT["relief_m"], "turned_m": 0.0})  # fmt: skip
    for latitude in (0.0, 45.0):
        step = degrees(latitude, 8.0)[1, 0] - 8.0
        write = tif(crs="EPSG:4326", cell=step, origin=(8.0, latitude + 15 * step), unit="m")
        answer = {"wide_m": RIGHT["wide_m"], "relief_m": RIGHT["relief_m"]}
        yield case("geotiff", f"degrees at latitude {latitude:g}", write, answer)
    yield case("geotiff", "no system", tif(crs=None))
    yield case("geotiff", "no system, --unit m", tif(crs=None), unit="m")
    yield case("geotiff", "no system, --unit ft", tif(crs=None), sized(FOOT_M, FOOT_M), unit="ft")
    spot = (8.0, 45.0)
    loose = tif(crs=None, cell=1 / 3600, origin=spot)
    yield case("geotiff", "no system, cells of a second", loose, "--unit deg")

    corner = {"xllcorner": 500000, "yllcorner": 4500000, "cellsize": STEP_M}
    yield case("grid", "metres", grid(corner))
    centre = {"xllcenter": 500000, "yllcenter": 4500000, "cellsize": STEP_M}
    yield case("grid", "the corner's centre", grid(centre))
    for void in (-9999.0, -99999.0):
        made = grid(corner | {"NODATA_value": void}, void)
        yield case("grid", f"NODATA_value {void:g}", made, holes)
        other = grid(corner | {"NODATA_value": -1.0}, void)
        yield case("grid", f"{void:g} is not the NODATA_value", other, "--no-data")
        yield case("grid", f"{void:g}, --no-data", other, holes, no_data=void)
    second = {"xllcorner": 8.0, "yllcorner": 45.0, "cellsize": 1 / 3600}
    yield case("grid", "cells of a second of degrees", grid(second), "--unit deg")
    small = {"xllcorner": 0.0, "yllcorner": 0.0, "cellsize": 0.01}
    yield case("grid", "cells of 0.01 at the origin", grid(small), "--unit")
    yield case("grid", "cells of 0.01, --unit m", grid(small), sized(0.005), unit="m")
    yield case("grid", "--unit ft", grid(corner, size=1 / FOOT_M),
               sized(FOOT_M), unit="ft")  # fmt: skip

    for statement, write in (
        ("no names", table("a.xyz")), ("names x y z", table("a.xyz", "x y z")),
        ("commas", table("a.csv", "x,y,z", ",")), ("semicolons", table("a.csv", "x;y;z", ";")),
        ("tabs", table("a.csv", "x\ty\tz", "\t")),
        ("decimal commas", table("a.csv", "x;y;z", ";", True)),
        ("decimal commas and blanks", table("a.xyz", comma=True)),
        ("far from the origin", table("a.xyz", points=POINTS + FAR_M)),
        ("another order of rows", table("a.xyz", points=POINTS[::-1])),
    ):  # fmt: skip
        yield case("points", statement, write)
    for void in ("nan", "NA", "NaN"):
        write = table("a.csv", "x,y,z", ",", void=void)
        yield case("points", f"{void} for a missing height", write, holes)
    for unit, size in (("mm", 1e3), ("cm", 100.0), ("ft", 1 / FOOT_M), ("km", 1e-3)):
        write = table("a.xyz", points=POINTS * size)
        yield case("points", f"--unit {unit}", write, unit=unit)
    place = degrees(45.0, 8.0)
    size = {key: RIGHT[key] for key in ("relief_m", "holes")}
    names = {"lon,lat,z": (0, 1, 2), "longitude,latitude,elevation": (0, 1, 2),
             "latitude,longitude,elevation": (1, 0, 2), "lat,lng,alt": (1, 0, 2),
             "Lat,Long,Height": (1, 0, 2), "elevation,lat,lon": (2, 1, 0)}  # fmt: skip
    for header, order in names.items():
        write = table("a.csv", header, ",", points=place[:, order])
        yield case("points", f"columns {header}", write, size | {"deep_m": RIGHT["deep_m"]},
                   spacing_m=2.0)  # fmt: skip
    for name, separator in (("a.xyz", " "), ("a.csv", ",")):
        write = table(name, "", separator, points=place)
        yield case("points", f"degrees without names, {name}", write, "--unit deg.*--unit m")
        yield case("points", f"degrees, --unit deg, {name}", write,
                   size | {"wide_m": RIGHT["wide_m"]}, unit="deg", spacing_m=2.0)  # fmt: skip
    swapped = table("a.xyz", points=degrees(45.0, 100.0)[:, [1, 0, 2]])
    yield case("points", "latitude first, --unit deg", swapped, "expected longitude", unit="deg")
    lifted = POINTS.copy()
    lifted[::60, 2] += 300.0
    yield case("points", "outliers 300 m up", table("a.xyz", points=lifted), "--assume highest_m")
    four = table("a.xyz", points=np.c_[POINTS, POINTS[:, 2]])
    yield case("points", "four numbers a point", four, "--columns x=COLUMN|add --columns")
    y_up = POINTS[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    for name in ("a.obj", "a.stl", "a.ply"):
        yield case("points", f"mesh {name}", solid(name), spacing_m=STEP_M)
        yield case("points", f"mesh {name}, --up y", solid(name, y_up), up="y", spacing_m=STEP_M)
        yield case("points", f"mesh {name}, --unit mm", solid(name, POINTS * 1e3), unit="mm",
                   spacing_m=STEP_M)  # fmt: skip
    yield case("points", "mesh a.glb, y up by glTF", solid("a.glb", y_up), spacing_m=STEP_M)
    yield case("points", "mesh a.glb, --up z", solid("a.glb"), up="z", spacing_m=STEP_M)
    yield case("points", "cloud a.ply", solid("a.ply", cloud=True))
    yield case("points", "cloud a.pcd", pcd)

    utm, us = CRS.from_epsg(32632).to_wkt(), feet.to_wkt()
    east = POINTS + FAR_M
    yield case("las", "a system in metres", laser(points=east, wkt=utm))
    yield case("las", "no system", laser(), "--unit m")
    yield case("las", "no system, --unit m", laser(), unit="m")
    yield case("las", "a system in feet", laser(points=POINTS / US_FOOT_M + [2e6, 5e5, 0], wkt=us),
               "--height-unit")  # fmt: skip
    yield case("las", "keys of a system in metres", laser(points=east, keys={3072: 32632}))
    classes = np.where(np.arange(len(POINTS)) % 7 == 0, 5, 2)
    trees = east + np.outer(classes == 5, [0.0, 0.0, 8.0])
    ground = laser(points=trees, kinds=classes, wkt=utm)
    for kind, more in ((2, {}), (5, {"classes": (5,)})):
        relief_m = float(np.ptp(HILL.ravel()[classes == kind]))
        yield case("las", f"points of class {kind} of two", ground, {"relief_m": relief_m},
                   spacing_m=STEP_M, **more)  # fmt: skip

    values = HILL[::-1]
    for name in ("a.csv", "a.npz"):
        yield case("raster", f"{name}, no size of cells", plain(name, values), "--cell")
        yield case("raster", f"{name}, --cell", plain(name, values), cell=STEP_M)
        yield case("raster", f"{name}, --cell in cm", plain(name, values * 100),
                   cell=100 * STEP_M, unit="cm")  # fmt: skip
    yield case("raster", "a picture without heights", plain("a.png", None), "--height-step")
    yield case("raster", "a picture, --height-step", plain("a.png", None), cell=STEP_M,
               height_step=0.01)  # fmt: skip
