"""Files of real ground: the same hill by every format; units, crops, holes; what is damaged."""

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
import rasterio
import trimesh
from rasterio.transform import from_origin

from snakewalk.config.errors import InputError
from snakewalk.controller.mapping.elevation_choice import ElevationChoice
from snakewalk.controller.mapping.elevation_file import MapOptions, read_elevation
from snakewalk.controller.mapping.point_cloud import read_pcd

ROWS, COLUMNS = 30, 41
X, Y = np.meshgrid(np.arange(COLUMNS) * 0.1, np.arange(ROWS) * 0.1)
HILL = np.rint(1000 * (0.5 + 0.3 * np.sin(X) * np.cos(0.7 * Y) + 0.05 * Y)) / 1000
"""(rows, columns), row 0 in the south; whole millimetres."""
POINTS = np.stack([X, Y, HILL], axis=-1).reshape(-1, 3)


def geotiff(file: Path, z, cell=0.1, **keys) -> None:
    with rasterio.open(
        file, "w", driver="GTiff", height=z.shape[0], width=z.shape[1], count=1,
        dtype=z.dtype, **{"transform": from_origin(500.0, 700.0, cell, cell)} | keys,
    ) as out:  # fmt: skip
        out.write(z, 1)


def pcd(points, data: str, fields="x y z", total=None, pad="") -> bytes:
    total = len(points) if total is None else total
    count = len(fields.split())
    head = (
        f"# .PCD v0.7\nVERSION 0.7\nFIELDS {fields}\nSIZE {'4 ' * count}\nTYPE {'F ' * count}\n"
        f"COUNT {'1 ' * count}\nWIDTH {total}\nHEIGHT 1\nPOINTS {total}\n{pad}DATA {data}\n"
    ).encode()
    rows = np.asarray(points, dtype="<f4")
    if data == "ascii":
        return head + "\n".join(" ".join(map(repr, row)) for row in rows.tolist()).encode()
    if data == "binary":
        return head + rows.tobytes()
    plain = rows.T.tobytes()
    packed = b"".join(
        bytes([len(plain[k : k + 32]) - 1]) + plain[k : k + 32] for k in range(0, len(plain), 32)
    )
    return head + struct.pack("<II", len(packed), len(plain)) + packed


def write(folder: Path, kind: str) -> tuple[Path, MapOptions]:
    file, told = folder / f"hill.{kind.split('-', maxsplit=1)[0]}", ElevationChoice(cell=0.1)
    north = HILL[::-1]
    if kind == "tif":
        geotiff(file, north.astype("float32"), crs="EPSG:32632")
        told = ElevationChoice()
    elif kind == "asc":
        head = f"ncols {COLUMNS}\nnrows {ROWS}\nxllcorner 5\nyllcorner 7\ncellsize 0.1\n"
        file.write_text(head + "\n".join(" ".join(map(str, row)) for row in north))
        told = ElevationChoice()
    elif kind == "png":
        cv2.imwrite(str(file), np.rint(1000 * north).astype(np.uint16))
        told = ElevationChoice(cell=0.1, height_step=0.001)
    elif kind == "csv":
        file.write_text("\n".join(";".join(map(str, row)) for row in north))
    elif kind == "csv-points":
        file.write_text("x,y,z\n" + "\n".join(",".join(map(str, row)) for row in POINTS))
    elif kind == "xyz":
        file.write_text("\n".join(" ".join(map(str, row)) for row in POINTS))
    elif kind == "npz":
        np.savez(file, elevation=north)
    elif kind.startswith("pcd"):
        file.write_bytes(pcd(POINTS, kind.split("-")[1]))
    elif kind == "ply-points":
        trimesh.PointCloud(POINTS).export(file)
    else:
        cell = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
        a, b = cell[:-1, :-1].ravel(), cell[:-1, 1:].ravel()
        c, d = cell[1:, 1:].ravel(), cell[1:, :-1].ravel()
        faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
        points = POINTS[:, [0, 2, 1]] * [1, 1, -1] if kind == "glb" else POINTS  # y up
        trimesh.Trimesh(points, faces, process=False).export(file)
    return file, MapOptions(told, spacing_m=0.1)


KINDS = [
    *("tif", "asc", "png", "csv", "csv-points", "xyz", "npz", "pcd-ascii", "pcd-binary"),
    *("pcd-binary_compressed", "ply-points", "ply", "obj", "stl", "glb"),
]


@pytest.mark.parametrize("kind", KINDS)
def test_every_format_gives_the_same_hill(kind: str, tmp_path: Path) -> None:
    read = read_elevation(*write(tmp_path, kind))
    assert read.elevation.z_m.shape == HILL.shape
    np.testing.assert_allclose(read.elevation.z_m, HILL, atol=1e-6)
    assert (read.elevation.x0_m, read.elevation.y0_m) == pytest.approx((-2.0, -1.45))
    assert read.size_m == pytest.approx((4.0, 2.9))
    assert read.relief_m == pytest.approx(np.ptp(HILL), abs=1e-6)


def test_scale_spacing_and_crop(tmp_path: Path) -> None:
    options = MapOptions(
        crop=(0.9 - 1e-5, 0.4 - 1e-5, 3.1 + 1e-5, 2.1 + 1e-5),
        scale=0.5,
        vertical_scale=2.0,
        spacing_m=0.05,
    )
    cells = HILL[4:21, 9:31]  # a raster's corner is that of its cell, half a cell off its sample
    samples = HILL[4:22, 9:32]
    for kind, inside in (("tif", cells), ("pcd-binary", samples), ("obj", samples)):
        found = read_elevation(write(tmp_path, kind)[0], options).elevation
        np.testing.assert_allclose(found.z_m, 2 * inside, atol=1e-4)


def test_units_of_rasters(tmp_path: Path) -> None:
    file = tmp_path / "a.tif"
    where = from_origin(8.0, 45.015, 0.001, 0.001)  # its middle is at 45
    geotiff(file, HILL[::-1].astype("float32"), crs="EPSG:4326", transform=where)
    wide, deep = read_elevation(file, MapOptions()).size_m
    # A thousandth of a degree at 45 degrees north: 78.85 m of longitude, 111.13 m of latitude
    # (WGS 84, as tables of the ellipsoid give it).
    assert wide == pytest.approx(40 * 78.847, rel=1e-4)
    assert deep == pytest.approx(29 * 111.13, rel=1e-4)
    geotiff(file, HILL[::-1].astype("float32"), crs="EPSG:2263")  # US survey feet
    with pytest.raises(InputError, match=r"in us-ft, .*\(--height-unit us-ft\)"):
        read_elevation(file, MapOptions(scale=10.0))
    read = read_elevation(file, MapOptions(ElevationChoice(height_unit="us-ft"), scale=10.0))
    assert read.size_m[0] == pytest.approx(4.0 * 1200 / 3937)
    assert read.relief_m == pytest.approx(np.ptp(HILL) * 1200 / 3937, rel=1e-6)
    geotiff(file, HILL[::-1].astype("float32"))
    said = read_elevation(file, MapOptions(ElevationChoice(unit="cm"), scale=100.0))
    assert said.size_m == pytest.approx((0.04, 0.029))


def test_cells_without_data_are_holes(tmp_path: Path) -> None:
    values = HILL[::-1].astype("float32")
    values[3:6, 4:9] = -9999
    hole = values[::-1] == -9999
    tiles = {"tiled": True, "blockxsize": 16, "blockysize": 16}
    geotiff(tmp_path / "a.tif", values, nodata=-9999, compress="lzw", **tiles)
    np.savez(tmp_path / "a.npz", elevation=values)
    told = MapOptions(ElevationChoice(cell=0.1, no_data=-9999.0))
    for file, options in (("a.tif", MapOptions()), ("a.npz", told)):
        found = read_elevation(tmp_path / file, options).elevation
        np.testing.assert_array_equal(found.known, ~hole)


def test_rows_from_the_south_are_turned(tmp_path: Path) -> None:
    file = tmp_path / "a.tif"
    upward = rasterio.Affine(0.1, 0.0, 5.0, 0.0, 0.1, 7.0)
    geotiff(file, HILL.astype("float32"), transform=upward)
    crop = (-1.0, -1.0, 9.0, 1.5)
    found = read_elevation(file, MapOptions(crop=crop)).elevation
    np.testing.assert_allclose(found.z_m, HILL[:15], atol=1e-6)
    geotiff(file, HILL.astype("float32"), transform=rasterio.Affine(0.1, 0.05, 5, 0.0, 0.1, 7))
    with pytest.raises(InputError, match="do not run west to east"):
        read_elevation(file, MapOptions())


def test_a_mesh_whose_y_is_up_is_turned(tmp_path: Path) -> None:
    file = tmp_path / "a.xyz"
    turned = POINTS[:, [0, 2, 1]] * [1, 1, -1]  # x, up, south
    np.savetxt(file, turned)
    found = read_elevation(file, MapOptions(ElevationChoice(up="y"), spacing_m=0.1)).elevation
    np.testing.assert_allclose(found.z_m, HILL, atol=1e-9)


def test_a_reference_back_in_compressed_points_repeats_bytes(tmp_path: Path) -> None:
    """x is 1.0 over and over: four bytes, and a copy that reaches into itself."""
    count = 20
    one = struct.pack("<f", 1.0)
    copy = bytes([(7 << 5) | 0, 4 * count - 4 - 9, 3])  # long: 7 + 2 + the next byte; back by 4
    column = bytes([3]) + one + copy
    packed = 3 * column
    head = pcd(np.zeros((count, 3)), "binary_compressed").split(b"compressed\n")[0]
    file = tmp_path / "a.pcd"
    file.write_bytes(head + b"compressed\n" + struct.pack("<II", len(packed), 12 * count) + packed)
    np.testing.assert_array_equal(read_pcd(file).points, np.ones((count, 3)))


def bad_png(folder: Path) -> bytes:
    """Says that it is 40000 by 40000."""
    head = struct.pack(">IIBBBBB", 40000, 40000, 16, 0, 0, 0, 0)
    chunk = b"IHDR" + head
    return (
        b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + chunk + struct.pack(">I", zlib.crc32(chunk))
    )


WHOLE = pcd(POINTS, "binary_compressed")
FAULTS = {
    "a.dxf": (b"", "ends in none of .tif"),
    "none.tif": (b"II*\x00nonsense", "cannot be read as GTiff"),
    "none.asc": (b"ncols 3\nnrows x\n", "cannot be read as AAIGrid"),
    "none.png": (b"no", "is no PNG"),
    "big.png": (bad_png(Path()), "would expand to"),
    "text.csv": (b"a,b\nc,d\n", "line 2: column 1: expected a number or nothing, found 'c'"),
    "ragged.csv": (b"1,2\n1\n", "all need as many"),
    "empty.csv": (b"", "holds no numbers"),
    "bytes.csv": (b"\xff\xfe\x00", "is not a table in UTF-8"),
    "none.npz": (b"PK", "is no .npz"),
    "cut.pcd": (WHOLE[:-40], "do not fit"),
    "head.pcd": (b"VERSION 0.7\n", "no header"),
    "bent.pcd": (WHOLE[:-60] + b"\xff" * 60, "compressed data are damaged"),
    "far.pcd": (pcd(POINTS, "binary", total=10**9), "would expand"),
    "many.pcd": (pcd(POINTS, "binary", total=2000), "states 2000 points, and contains 1230"),
    "minus.pcd": (pcd(POINTS, "binary", total=-5), "states -5 points"),
    "no-z.pcd": (pcd(POINTS, "binary", "x y w"), "x, y and z are needed"),
    "nan.pcd": (pcd(POINTS * np.nan, "binary"), "holds no point"),
    "none.ply": (b"ply\nformat ascii 1.0\nelement vertex 999999999\nend_header\n", "more elem"),
    "none.obj": (b"v 1 2 3\n", "holds no triangles|cannot be read"),
    "none.stl": (b"solid\n", "holds no triangles|cannot be read"),
    "none.glb": (b"glTF", "cannot be read"),
    "four.xyz": (b"1 2\n3 4\n", "2 columns, without names"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_what_cannot_be_read_is_said_in_a_line(name: str, tmp_path: Path) -> None:
    data, expected = FAULTS[name]
    (tmp_path / name).write_bytes(data)
    told = MapOptions(ElevationChoice(cell=0.1, height_step=0.001), spacing_m=0.1)
    with pytest.raises(InputError, match=expected) as caught:
        read_elevation(tmp_path / name, told)
    assert name in str(caught.value)


def test_what_a_file_leaves_unsaid_is_asked_for(tmp_path: Path) -> None:
    for kind, expected in (("png", "--height-step"), ("csv", "--cell"), ("npz", "--cell")):
        with pytest.raises(InputError, match=expected):
            read_elevation(write(tmp_path, kind)[0], MapOptions())
    geotiff(tmp_path / "plain.tif", HILL.astype("float32"), transform=rasterio.Affine.identity())
    with pytest.raises(InputError, match="--cell"):
        read_elevation(tmp_path / "plain.tif", MapOptions())
    for kind in ("tif", "pcd-binary", "obj"):
        with pytest.raises(InputError, match=r"within the crop"):
            read_elevation(write(tmp_path, kind)[0], MapOptions(crop=(50.0, 50.0, 60.0, 60.0)))
    colour = tmp_path / "c.png"
    cv2.imwrite(str(colour), np.zeros((9, 9, 3), np.uint8))
    with pytest.raises(InputError, match="picture in colours"):
        read_elevation(colour, MapOptions())
    size = {"height": 9, "width": 9, "count": 3, "dtype": "uint8"}
    with rasterio.open(tmp_path / "rgb.tif", "w", driver="GTiff", **size) as out:
        out.write(np.zeros((3, 9, 9), np.uint8))
    with pytest.raises(InputError, match="picture of 3 bands"):
        read_elevation(tmp_path / "rgb.tif", MapOptions())


def test_real_points_of_a_hillside(shared_data: Path) -> None:
    """38,010 points of an airborne laser, 134 m by 303 m; with roofs, and the ground alone."""
    folder = shared_data / "aerial-terrain"
    if not folder.is_dir():
        pytest.skip("no aerial terrain beside this clone")
    points, ground = (read_pcd(folder / f"samp11-utm{end}.pcd").points for end in ("", "-ground"))
    assert (len(points), len(ground)) == (38010, 21786)
    assert np.ptp(points, axis=0) == pytest.approx([134, 303, 109], abs=1)
    read = read_elevation(folder / "samp11-utm-ground.pcd", MapOptions(scale=0.03, spacing_m=0.08))
    assert 0.5 < read.elevation.known.mean() < 1.0
    centre = 0.5 * (ground[:, :2].min(axis=0) + ground[:, :2].max(axis=0))
    near = np.abs(ground[:, :2] - centre).max(axis=1) < 12.0
    rows, columns = read.elevation.z_m.shape
    middle = read.elevation.z_m[rows // 2 - 4 : rows // 2 + 5, columns // 2 - 4 : columns // 2 + 5]
    assert np.nanmedian(middle) == pytest.approx(0.03 * np.median(ground[near, 2]), abs=0.1)


DEGREES = np.stack(
    [8.0 + 1e-5 * X.ravel(), 47.0 + 1e-5 * Y.ravel(), 100.0 + 10.0 * HILL.ravel()], axis=-1
)
"""Longitude, latitude and height: 4 m of x are 4e-5 degrees."""
SIZE_M = (3.038, 3.224)
"""4e-5 degrees of longitude at 47 degrees north, and 2.9e-5 of latitude: 75.96 km and 111.17 km a
degree (WGS 84, e.g. the table of the National Geospatial-Intelligence Agency)."""


@pytest.mark.parametrize("ending", ["csv", "xyz"])
def test_points_that_may_be_degrees_are_asked_about_with_both_readings(
    tmp_path: Path, ending: str
) -> None:
    file = tmp_path / f"a.{ending}"
    np.savetxt(file, DEGREES, fmt="%.9f", delimiter="," if ending == "csv" else " ")
    with pytest.raises(InputError, match=r"3\.0\d* m by 3\.2\d* m \(--unit deg\).*--unit m"):
        read_elevation(file, MapOptions())
    found = read_elevation(file, MapOptions(ElevationChoice(unit="deg")))
    np.testing.assert_allclose(found.size_m, SIZE_M, rtol=2e-3)
    assert found.relief_m == pytest.approx(10.0 * np.ptp(HILL), rel=0.1)
    far = POINTS + np.array([500.0, 0.0, 0.0])
    np.savetxt(file, far, delimiter="," if ending == "csv" else " ")
    with pytest.raises(InputError, match="longitude, latitude and height"):
        read_elevation(file, MapOptions(ElevationChoice(unit="deg")))


@pytest.mark.parametrize("names", ["lon,lat,z", "longitude,latitude,elevation"])
def test_columns_named_as_degrees_are_degrees_in_any_order(tmp_path: Path, names: str) -> None:
    np.savetxt(tmp_path / "a.csv", DEGREES, fmt="%.9f", delimiter=",", header=names, comments="")
    first, second, height = names.split(",")
    turned = f"{second},{first},{height}"
    swapped = DEGREES[:, [1, 0, 2]]
    np.savetxt(tmp_path / "b.csv", swapped, fmt="%.9f", delimiter=",", header=turned, comments="")
    for name in ("a.csv", "b.csv"):
        found = read_elevation(tmp_path / name, MapOptions())
        np.testing.assert_allclose(found.size_m, SIZE_M, rtol=2e-3)
        assert found.facts["unit"].value == "deg"
        assert found.facts["unit"].basis.startswith("the names of its columns")


def test_small_scans_near_their_origin_are_metres(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "a.xyz", 0.2 * POINTS)
    assert read_elevation(tmp_path / "a.xyz", MapOptions()).size_m == pytest.approx((0.8, 0.58))


def test_a_raster_of_classes_is_rejected(tmp_path: Path) -> None:
    file = tmp_path / "classes.tif"
    size = {"height": ROWS, "width": COLUMNS, "count": 1, "dtype": "uint8"}
    place = {"transform": from_origin(500.0, 700.0, 0.1, 0.1), "crs": "EPSG:32632"}
    with rasterio.open(file, "w", driver="GTiff", **size, **place) as out:
        out.write((HILL * 10).astype("uint8"), 1)
        out.write_colormap(1, {k: (k, k, 0, 255) for k in range(256)})
    with pytest.raises(InputError, match="marked as palette: its values are classes, not heights"):
        read_elevation(file, MapOptions())
    rgba = {"height": ROWS, "width": COLUMNS, "count": 4, "dtype": "uint16", "photometric": "RGB"}
    with rasterio.open(file, "w", driver="GTiff", **rgba, **place) as out:
        out.write(np.repeat((HILL * 1000).astype("uint16")[None], 4, axis=0))
    with pytest.raises(InputError, match="marked as red: its values are a picture, not heights"):
        read_elevation(file, MapOptions())
