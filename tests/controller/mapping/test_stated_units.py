"""What an elevation file states of itself is used; what it leaves unsaid is asked for."""

import json
import math
import resource
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from rasterio.crs import CRS
from rasterio.transform import from_origin
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.file_units import LENGTHS_M, named_unit
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.mapping.elevation_choice import ElevationChoice
from snakewalk.controller.mapping.elevation_file import FileMap, MapOptions, read_elevation
from snakewalk.controller.mapping.length_units import vertical_unit
from snakewalk.controller.mapping.number_table import read_numbers
from snakewalk.controller.terrain.relief import Relief, elevation_variance_m2

ROWS, COLUMNS = 30, 40
Y, X = np.mgrid[0:ROWS, 0:COLUMNS]
RELIEF = 32.76
HILL = (100.0 + RELIEF * np.exp(-((X - 20) ** 2 + (Y - 15) ** 2) / 60.0)).astype("float32")
FEET = float(np.ptp(HILL)) * 1200 / 3937
COMPOUND = "EPSG:26917+6360"
"""UTM zone 17 N, and NAVD88 heights in US survey feet."""
WKT = (
    'COMPD_CS["c",PROJCS["p",UNIT["metre",1]],VERT_CS["NAVD88 height (ftUS)",VERT_DATUM["d",2005],'
    'UNIT["US survey foot",0.304800609601219],AXIS["Gravity-related height",UP]]]'
)


def geotiff(
    file: Path, values: Any = HILL, *, crs: Any = "EPSG:26917", transform: Any = None,
    unit: str = "", scale: tuple[float, float] = (1.0, 0.0), **profile: Any,
) -> Path:  # fmt: skip
    where = from_origin(500000, 4500000, 1.0, 1.0) if transform is None else transform
    with rasterio.open(
        file, "w", driver="GTiff", height=values.shape[0], width=values.shape[1],
        count=profile.pop("count", 1), dtype=values.dtype, crs=crs, transform=where, **profile,
    ) as out:  # fmt: skip
        out.write(values, 1)
        if unit:
            out.units = [unit] * out.count
        if scale != (1.0, 0.0):
            out.scales, out.offsets = [scale[0]], [scale[1]]
    return file


def read(file: Path, **units: Any) -> FileMap:
    scale = units.pop("scale", 1.0)
    spacing = units.pop("spacing_m", None)
    crop = units.pop("crop", None)
    told = MapOptions(ElevationChoice(**units), crop=crop, scale=scale, spacing_m=spacing)
    return read_elevation(file, told)


def noted(found: FileMap, words: str) -> bool:
    return any(words in line for line in (*found.notes, *map(str, found.facts.values())))


@pytest.mark.parametrize(
    "unit", ["ft", "US survey foot", "foot_us", "us-ft", "feet", "Foot (International)"]
)
def test_heights_have_the_unit_of_the_band(tmp_path: Path, unit: str) -> None:
    found = read(geotiff(tmp_path / "a.tif", unit=unit))
    assert found.relief_m == pytest.approx(FEET, rel=1e-5)
    assert found.size_m == (COLUMNS - 1, ROWS - 1)
    assert noted(found, "ft (stated by its band)")


def test_heights_have_the_unit_of_the_vertical_system(tmp_path: Path) -> None:
    found = read(geotiff(tmp_path / "a.tif", crs=COMPOUND, GEOTIFF_VERSION="1.1"))
    assert found.relief_m == pytest.approx(FEET, rel=1e-6)
    assert noted(found, "us-ft (stated by its band)")


def test_units_are_known_by_their_spellings() -> None:
    spelled = {"metre": "m", "Meters": "m", "US survey foot": "us-ft", "ft": "ft", "cm": "cm"}
    assert {words: named_unit(words) for words in spelled} == spelled
    assert named_unit("kelvin") is None
    assert vertical_unit(WKT) == "us-ft"
    wkt2 = 'VERTCRS["h",VDATUM["d"],CS[vertical,1],AXIS["up",up,LENGTHUNIT["foot",0.3048]]]'
    assert vertical_unit(f'COMPOUNDCRS["c",PROJCRS["p",UNIT["metre",1]],{wkt2}]') == "ft"
    assert vertical_unit('PROJCRS["p",LENGTHUNIT["metre",1]]') is None
    assert LENGTHS_M["us-ft"] == 1200 / 3937


def test_an_unknown_unit_of_heights_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="its heights are in 'kelvin'; state --height-unit"):
        read(geotiff(tmp_path / "a.tif", unit="kelvin"))


def test_two_statements_that_differ_are_asked_about(tmp_path: Path) -> None:
    file = geotiff(tmp_path / "a.tif", crs=COMPOUND, unit="metre", GEOTIFF_VERSION="1.1")
    with pytest.raises(InputError, match=r"in m \(band\), us-ft \(system\); choose by"):
        read(file)
    assert read(file, height_unit="m").relief_m == pytest.approx(np.ptp(HILL))


def test_feet_across_say_nothing_of_heights(tmp_path: Path) -> None:
    where = from_origin(1e6, 2e5, 1.0, 1.0)
    file = geotiff(tmp_path / "a.tif", crs="EPSG:2263", transform=where)
    with pytest.raises(InputError, match=r"x and y are in us-ft, .*unit us-ft\) or .*unit m\)"):
        read(file)
    found = read(file, height_unit="m")
    assert found.relief_m == pytest.approx(np.ptp(HILL))
    assert found.size_m[0] == pytest.approx((COLUMNS - 1) * 1200 / 3937)


def test_metres_across_and_no_unit_of_heights_are_metres_and_noted(tmp_path: Path) -> None:
    found = read(geotiff(tmp_path / "a.tif"))
    assert found.relief_m == pytest.approx(np.ptp(HILL))
    assert noted(found, "the file states no unit of heights: metres")


def test_an_option_overrides_what_a_file_states_and_is_noted(tmp_path: Path) -> None:
    found = read(geotiff(tmp_path / "a.tif", unit="ft"), unit="m")
    assert found.relief_m == pytest.approx(np.ptp(HILL))
    assert noted(found, "m (stated by you: --unit; the file states ft)")


def test_scale_and_offset_of_the_band(tmp_path: Path) -> None:
    values = np.rint((HILL - 100.0) * 100.0).astype("int16")
    found = read(geotiff(tmp_path / "a.tif", values, scale=(0.01, 100.0)))
    assert found.relief_m == pytest.approx(np.ptp(HILL), abs=0.01)
    assert noted(found, "heights are 0.01 times the values plus 100, as it states")
    found = read(geotiff(tmp_path / "b.tif", values, scale=(0.01, 100.0)), height_step=0.02)
    assert found.relief_m == pytest.approx(2 * np.ptp(HILL), abs=0.02)
    assert noted(found, "the band's scale 0.01 and offset 100 are left out for --height-step")


def test_web_mercator_has_true_lengths_on_the_ground(tmp_path: Path) -> None:
    north = 6378137.0 * math.log(math.tan(math.pi / 4 + math.radians(50.0) / 2))
    where = from_origin(900000.0, north, 10.0, 10.0)
    found = read(geotiff(tmp_path / "a.tif", crs="EPSG:3857", transform=where))
    # 10 m of the map at 50 degrees north are 10 N cos(50) / a and 10 M cos(50) / a on the ground,
    # N and M the radii of curvature of WGS 84: 6390702.044 and 6373331.4 m
    wide, deep = 10 * 6390702.044 / 6378137 * math.cos(math.radians(50)), 10 * 0.642305
    assert found.size_m[0] == pytest.approx((COLUMNS - 1) * wide, rel=2e-4)
    assert found.size_m[1] == pytest.approx((ROWS - 1) * deep, rel=2e-3)
    assert noted(found, "the projection has no true lengths: 1 m of it is 0.6441 m west to east")
    utm = read(geotiff(tmp_path / "b.tif", crs="EPSG:32632"))
    assert utm.size_m == (COLUMNS - 1, ROWS - 1)
    assert not noted(utm, "true lengths")


@pytest.mark.parametrize("code", [3857, 3395, 6933, 3413, 54009])
def test_true_lengths_of_any_projection(tmp_path: Path, code: int) -> None:
    """Against the distances of the corners of one cell, by the ellipsoid, 60 degrees north."""
    from rasterio.warp import transform

    crs = CRS.from_user_input(f"ESRI:{code}" if code == 54009 else f"EPSG:{code}")
    [x], [y] = transform("EPSG:4326", crs, [-45.0], [60.0])
    file = geotiff(tmp_path / "a.tif", crs=crs, transform=from_origin(x, y, 30.0, 30.0))
    found = read(file)
    middle = x + 15.0 * COLUMNS, y - 15.0 * ROWS
    corners = [middle, (middle[0] + 30.0, middle[1]), (middle[0], middle[1] + 30.0)]
    longitude, latitude = np.radians(transform(crs, "EPSG:4326", *zip(*corners, strict=True)))
    a, e2 = 6378137.0, 0.00669437999014
    w = 1 - e2 * np.sin(latitude[0]) ** 2
    east = (longitude[1:] - longitude[0]) * a / np.sqrt(w) * np.cos(latitude[0])
    north = (latitude[1:] - latitude[0]) * a * (1 - e2) / w**1.5
    expected = np.hypot(east, north) * [COLUMNS - 1, ROWS - 1]
    np.testing.assert_allclose(found.size_m, expected, rtol=5e-3)


def test_a_projection_that_changes_over_the_file_is_asked_to_be_cropped(tmp_path: Path) -> None:
    where = from_origin(0.0, 9e6, 2e5, 2e5)
    with pytest.raises(InputError, match=r"projection's scale changes by .* --crop a smaller part"):
        read(geotiff(tmp_path / "a.tif", crs="EPSG:3857", transform=where), spacing_m=1e5)


def asc(file: Path, values: Any = HILL, cell: float = 1 / 1200, x: float = 8.0, y: float = 45.0,
        more: str = "") -> Path:  # fmt: skip
    rows, columns = values.shape
    head = f"ncols {columns}\nnrows {rows}\nxllcorner {x}\nyllcorner {y}\ncellsize {cell!r}\n{more}"
    file.write_text(head + "\n".join(" ".join(f"{v:.3f}" for v in row) for row in values))
    return file


def test_degrees_without_a_system_are_asked_about(tmp_path: Path) -> None:
    file = asc(tmp_path / "a.asc")
    with pytest.raises(InputError, match=r"states no system; .*\(--unit deg\) or .*\(--unit m\)"):
        read(file)
    found = read(file, unit="deg")
    assert found.size_m == pytest.approx((65.7 * (COLUMNS - 1), 92.6 * (ROWS - 1)), rel=2e-3)
    assert read(file, unit="m").size_m[0] == pytest.approx((COLUMNS - 1) / 1200)
    bare = geotiff(tmp_path / "b.tif", crs=None, transform=from_origin(8.0, 45.0, 1e-4, 1e-4))
    with pytest.raises(InputError, match="--unit deg"):
        read(bare)
    projected = asc(tmp_path / "c.asc", cell=1.0, x=500000.0, y=4e6)
    assert read(projected).size_m == (COLUMNS - 1, ROWS - 1)
    Path(tmp_path / "a.prj").write_text(CRS.from_epsg(4326).to_wkt("WKT1_ESRI"))
    assert read(file).size_m == pytest.approx(found.size_m)


def test_untagged_values_for_missing_cells_are_asked_about(tmp_path: Path) -> None:
    values = HILL.copy()
    values[3:6, 4:9] = -9999.0
    for file in (
        geotiff(tmp_path / "a.tif", values),
        asc(tmp_path / "a.asc", values, 1.0, 5e5, 4e6),
    ):
        with pytest.raises(
            InputError, match=r"heights of -9999 m in 15 cells: no dry land .* --no-data -9999 if"
        ):
            read(file)
        found = read(file, no_data=-9999.0)
        assert found.relief_m == pytest.approx(np.ptp(HILL), abs=1e-3)
        assert found.elevation.known.mean() == 1 - 15 / 1200
        assert noted(found, "15 cells hold no height")
        found = read(file, assume={"lowest_m": "-10000"})
        assert found.relief_m == pytest.approx(9999 + HILL.max(), rel=1e-6)
    tagged = geotiff(tmp_path / "b.tif", values, nodata=-9999.0)
    assert read(tagged).elevation.known.mean() == 1 - 15 / 1200


@pytest.mark.parametrize("value", [-32767.0, -3.4e38, 32767.0, 9999.0, 1e20, -500.0])
def test_other_values_that_no_ground_has(tmp_path: Path, value: float) -> None:
    values = HILL.copy()
    values[0, :5] = value
    with pytest.raises(InputError, match=r"in 5 cells: no (dry )?land .* add --no-data"):
        read(geotiff(tmp_path / "a.tif", values))


def test_a_value_far_below_all_others_is_asked_about(tmp_path: Path) -> None:
    values = HILL + 400.0
    values[:4] = 0.0
    with pytest.raises(InputError, match="heights of 0 m in 160 cells: 500 m below all others"):
        read(geotiff(tmp_path / "a.tif", values))
    assert read(geotiff(tmp_path / "a.tif", values), no_data=0.0).relief_m < 40.0
    assert read(geotiff(tmp_path / "a.tif", values), assume={"lowest_m": "0"}).relief_m > 500.0
    sea = np.maximum(HILL - 120.0, 0.0)  # a shore of the relief of the land
    assert read(geotiff(tmp_path / "b.tif", sea)).relief_m == pytest.approx(np.ptp(sea))


def test_several_bands_are_noted(tmp_path: Path) -> None:
    found = read(geotiff(tmp_path / "a.tif", count=3))
    assert noted(found, "band 1 of 3 is read")


@pytest.mark.slow
def test_a_large_tile_is_read_in_strips(tmp_path: Path) -> None:
    """The medians of the cells nearest to each sample, as of a small one read at once."""
    rng = np.random.default_rng(0)
    values = (HILL[:, :, None, None] + rng.normal(0, 1, (ROWS, COLUMNS, 5, 5))).astype("float32")
    tile = values.transpose(0, 2, 1, 3).reshape(5 * ROWS, 5 * COLUMNS)
    tile[40:47, 60:80] = np.nan
    file = geotiff(tmp_path / "a.tif", tile, tiled=True, blockxsize=64, blockysize=64)
    for spacing in (5.0, 3.3, 2.0):
        found = read(file, spacing_m=spacing).elevation
        south = tile[::-1]
        row, column = np.nonzero(np.isfinite(south))
        cell = np.rint(row / spacing).astype(int), np.rint(column / spacing).astype(int)
        expected = np.full(found.z_m.shape, np.nan)
        for key in np.unique(np.stack(cell, -1), axis=0):
            inside = (cell[0] == key[0]) & (cell[1] == key[1])
            expected[tuple(key)] = np.median(south[row[inside], column[inside]])
        np.testing.assert_allclose(found.z_m, expected, atol=1e-4)
    upward = rasterio.Affine(1.0, 0.0, 5e5, 0.0, 1.0, 4e6)
    south_up = geotiff(tmp_path / "b.tif", tile[::-1], transform=upward)
    np.testing.assert_allclose(
        read(south_up, spacing_m=5.0).elevation.z_m, read(file, spacing_m=5.0).elevation.z_m
    )
    assert noted(read(file, spacing_m=5.0), "30000 cells are reduced to")


def test_more_samples_than_a_map_holds_are_not_read(tmp_path: Path) -> None:
    sizes = {"height": 30000, "width": 30000, "count": 1, "dtype": "float32", "tiled": True,
             "sparse_ok": True, "compress": "deflate", "crs": "EPSG:32632",
             "transform": from_origin(5e5, 4e6, 1, 1)}  # fmt: skip
    with rasterio.open(tmp_path / "a.tif", "w", driver="GTiff", **sizes):
        pass  # nothing is written: a sparse file
    with pytest.raises(InputError, match="cells are over 16000000: give a --spacing of 2 cells"):
        read(tmp_path / "a.tif")
    with pytest.raises(InputError, match=r"samples are over 4000000; use a --spacing of 15 m"):
        read(tmp_path / "a.tif", spacing_m=3.0)
    with pytest.raises(InputError, match=r"no cell holds a height|fewer than"):
        read(tmp_path / "a.tif", spacing_m=100.0, crop=(0, 0, 500, 500), no_data=0.0)


def test_a_map_of_tiny_cells_needs_no_more_memory_than_its_samples(tmp_path: Path) -> None:
    """A window of 0.3 m over cells of 40 micrometres: of 15,000 samples, of which 40 exist."""
    ground = HeightField(np.asarray(HILL, float), 4e-5, 0.0, 0.0)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    relief = Relief(ground, PlannerConfig())
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kilobytes
    np.testing.assert_allclose(elevation_variance_m2(ground, 0.3), HILL.astype(float).var())
    assert not relief.safe(8e-4, 6e-4)


def test_decimal_commas_are_read_where_commas_can_be_nothing_else(tmp_path: Path) -> None:
    file, notes = tmp_path / "a.csv", list[str]()
    file.write_text("a;b\n1,25;2\n-0,5;1,125\n;NA\n")
    np.testing.assert_array_equal(
        read_numbers(file, notes), [[1.25, 2.0], [-0.5, 1.125], [np.nan, np.nan]]
    )
    assert notes == ["numbers have decimal commas"]
    file.write_text("1,25 2,5 3\n4,0 5,0 6,5\n")
    np.testing.assert_array_equal(read_numbers(file, []), [[1.25, 2.5, 3.0], [4.0, 5.0, 6.5]])
    file.write_text("1,250;2,500\n3,000;4,125\n")
    with pytest.raises(InputError, match="'1,250' has a comma for decimals or for thousands"):
        read_numbers(file, [])


def test_a_cell_that_is_no_number_is_named_by_row_and_column(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("# of a garden\nx,y,z\n1,2,3\n\n4,five,6\n")
    with pytest.raises(
        InputError, match="line 5: column 2: expected a number or nothing, found 'five'"
    ):
        read_numbers(file, [])
    file.write_text("1,2,3\n4,5\n")
    with pytest.raises(InputError, match="line 2 holds 2 numbers, line 1 holds 3"):
        read_numbers(file, [])


def pcd(file: Path, points: Any, width: int, height: int, viewpoint: str = "0 0 0 1 0 0 0") -> Path:
    head = (
        f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {width}\n"
        f"HEIGHT {height}\nVIEWPOINT {viewpoint}\nPOINTS {len(points)}\nDATA binary\n"
    )
    file.write_bytes(head.encode() + np.asarray(points, "<f4").tobytes())
    return file


def room(count: int = 120) -> Any:
    """Points of a depth camera 1 m above a floor, 4 m before a wall: x right, y down, z ahead."""
    v, u = np.mgrid[0:count, 0:count].reshape(2, -1) / count - 0.5
    ahead = np.minimum(4.0, np.where(v > 0, 1.0 / np.maximum(v, 1e-9), 4.0))
    return np.stack([u * ahead, v * ahead, ahead], axis=-1)


def test_points_of_a_depth_camera_are_no_terrain_as_they_are(tmp_path: Path) -> None:
    file = pcd(tmp_path / "a.pcd", room(), 120, 120)
    with pytest.raises(InputError, match=r"is a depth picture of 120 by 120 points .* add --up -y"):
        read(file)
    loose = pcd(tmp_path / "b.pcd", room(), 120 * 120, 1)
    with pytest.raises(InputError, match=r"is not ground seen from above: \d+ % .* --up AXIS"):
        read(loose, spacing_m=0.1)
    turned = read(file, up="-y", spacing_m=0.1, point="highest")
    assert turned.relief_m == pytest.approx(3.0, abs=0.1)  # the wall, up from the floor
    flat = turned.elevation.z_m
    assert np.nanmedian(np.abs(flat - np.nanmin(flat))) < 0.02  # most of it is floor


@pytest.mark.parametrize("up", ["z", "-z", "y", "-y", "x", "-x"])
def test_any_axis_may_point_up_and_nothing_is_mirrored(tmp_path: Path, up: str) -> None:
    """A corner that is left of another stays left of it, seen from above."""
    east, north, high = (5, 0, 0.0), (0, 5, 0.0), 2.0
    plane = [(x, y, high * (x == 0 == y)) for x in range(6) for y in range(6)]
    assert east != north
    axis, sign = "xyz".index(up[-1]), -1.0 if up[0] == "-" else 1.0
    first, second = [k for k in range(3) if k != axis]
    points = np.zeros((36, 3))
    points[:, axis] = [sign * z for *_, z in plane]
    points[:, first] = [x for x, *_ in plane]
    points[:, second] = [y * 0.5 for _, y, _ in plane]
    np.savetxt(tmp_path / "a.xyz", points)
    found = read(tmp_path / "a.xyz", up=up, spacing_m=0.5)
    assert found.relief_m == 2.0
    turn = np.zeros((3, 3))
    turn[2, axis] = sign
    held = found.elevation.z_m
    assert np.nanmax(held) == high
    assert sorted(found.size_m) == [2.5, 5.0]


def test_a_wooded_hill_is_ground_seen_from_above(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    x, y = rng.uniform(0, 40, 20000), rng.uniform(0, 30, 20000)
    z = 0.5 * x + np.where(rng.random(20000) < 0.3, rng.uniform(0, 6, 20000), 0.0)
    np.savetxt(tmp_path / "a.xyz", np.stack([x, y, z], -1))
    assert read(tmp_path / "a.xyz", spacing_m=1.0).elevation.known.mean() > 0.99


def test_points_without_numbers_and_a_pose_of_the_sensor_are_noted(tmp_path: Path) -> None:
    points = np.stack([X.ravel(), Y.ravel(), HILL.ravel()], -1)
    points[7] = np.nan
    found = read(pcd(tmp_path / "a.pcd", points, len(points), 1, "1 2 3 1 0 0 0"), spacing_m=1.0)
    assert noted(found, "1 points without numbers are left out")
    assert noted(found, "VIEWPOINT 1 2 3 1 0 0 0 is not used")


def test_the_result_and_the_worlds_file_hold_the_notes(tmp_path: Path) -> None:
    file, out = geotiff(tmp_path / "a.tif", unit="ft"), tmp_path / "w.toml"
    words = ["world", "from", str(file), "-o", str(out), "--json", "--scale", "0.1"]
    ran = CliRunner().invoke(app, words)
    assert ran.exit_code == 0, ran.output
    assert json.loads(ran.stdout)["facts"]["height_unit"] == "ft (stated by its band)"
    assert "# - ft (stated by its band)" in out.read_text()
    values = HILL.copy()
    values[0, 0] = -9999
    geotiff(file, values, unit="m")
    words = [*words, "--force", "--assume", "lowest_m=-9999"]
    ran = CliRunner().invoke(app, words)
    assert ran.exit_code == 0, ran.output
    assert "# - assumed by option: lowest_m = -9999" in out.read_text()
    ran = CliRunner().invoke(app, [*words, "--assume", "nothing=1"])
    assert "this file does not need it" in str(ran.exception)


@pytest.mark.slow
def test_broken_rasters_end_with_a_line(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    whole = geotiff(tmp_path / "a.tif", unit="ft", compress="deflate").read_bytes()
    text = asc(tmp_path / "a.asc", cell=1.0, x=5e5, y=4e6).read_bytes()
    outcomes = {"read": 0, "rejected": 0}
    for number in range(300):
        name, data = ("b.tif", whole) if number % 2 else ("b.asc", text)
        raw = bytearray(data)
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(min(len(raw), 600)))
            if rng.random() < 0.7:
                raw[at] = int(rng.integers(256)) if number % 2 else 48 + int(rng.integers(10))
            else:
                del raw[at : at + int(rng.integers(1, 200))]
        (tmp_path / name).write_bytes(bytes(raw))
        try:
            read(tmp_path / name, spacing_m=5.0)
            outcomes["read"] += 1
        except (InputError, OSError):
            outcomes["rejected"] += 1
    assert min(outcomes.values()) > 20


def surface(x: Any, y: Any) -> Any:
    return np.column_stack([x, y, np.sin(x / 5.0) + np.cos(y / 7.0)])


@pytest.mark.parametrize(("step_m", "corner_m"), [(1.0, 0.0), (0.25, 500000.0)])
def test_points_of_a_grid_keep_its_step(tmp_path: Path, step_m: float, corner_m: float) -> None:
    points = surface(step_m * X.ravel(), step_m * Y.ravel())
    points[:, :2] += corner_m
    np.savetxt(tmp_path / "a.xyz", points, fmt="%.4f")
    kept = np.delete(points, slice(100, 130), axis=0)
    np.savetxt(tmp_path / "b.xyz", kept, fmt="%.4f")
    for name in ("a.xyz", "b.xyz"):
        made = read(tmp_path / name, unit="m")
        assert made.elevation.spacing_m == pytest.approx(step_m)
        assert made.elevation.z_m.shape == (ROWS, COLUMNS)
        assert f"points lie on a grid of {step_m:g} m" in made.notes
    assert np.isnan(read(tmp_path / "b.xyz", unit="m").elevation.z_m).sum() == 30


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_few_points_far_from_all_others_are_asked_about(tmp_path: Path, sign: float) -> None:
    rng = np.random.default_rng(3)
    points = surface(*rng.uniform(0.0, [40.0, 30.0], (3000, 2)).T)
    points[:60, 2] += sign * rng.uniform(295.0, 305.0, 60)
    np.savetxt(tmp_path / "a.xyz", points, fmt="%.4f")
    side, key = ("above", "highest_m") if sign > 0.0 else ("below", "lowest_m")
    said = rf"60 points \(2 %\) lie 29\d.* m {side} all others; .*{key}=\S+ to leave them out"
    with pytest.raises(InputError, match=said):
        read(tmp_path / "a.xyz", unit="m")
    made = read(tmp_path / "a.xyz", unit="m", assume={key: f"{3.0 * sign:g}"})
    assert made.relief_m < 4.1
    assert "60 points beyond the stated heights are left out" in made.notes
    kept = read(tmp_path / "a.xyz", unit="m", assume={key: f"{307.0 * sign:g}"})
    assert kept.relief_m > 290.0
