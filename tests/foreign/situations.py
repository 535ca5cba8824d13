"""Further files, each a situation of a public report or of a format's specification.

The answers were written before a reader saw the files. A citation follows each group:
``owner/repository#number`` is a report on GitHub.
"""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from rasterio.transform import Affine
from scipy.spatial.transform import Rotation

from tests.controller.track.readers.test_bvh import bvh
from tests.controller.track.readers.test_marker_tables import motive, qtm, trc, vicon
from tests.foreign import grounds, motions, robots, tracks
from tests.foreign.case import Case
from tests.foreign.grounds import COLUMNS, POINTS, ROWS, STEP_M
from tests.foreign.motions import NAMES
from tests.foreign.robots import calibration, mjcf, urdf
from tests.foreign.tracks import RATE_HZ, markers, midlines

Write = Callable[[Path], Path]


def bytes_of(write: Write, change: Callable[[bytes], bytes]) -> Write:
    """Return what writes a file and changes its bytes."""

    def write_changed(folder: Path) -> Path:
        file = write(folder)
        file.write_bytes(change(file.read_bytes()))
        return file

    return write_changed


def first_line(change: Callable[[str], str]) -> Callable[[str], str]:
    def changed(text: str) -> str:
        head, body = text.split("\n", 1)
        return f"{change(head)}\n{body}"

    return changed


def windows(data: bytes) -> bytes:
    return data.replace(b"\n", b"\r\n")


def marked(data: bytes) -> bytes:
    return b"\xef\xbb\xbf" + data


def joints() -> Iterator[Case]:
    def case(statement: str, write: Write, answer: Any = motions.RIGHT, **options: Any) -> Case:
        return Case("joints", statement, write, motions.read, answer, options)

    table = motions.table
    # Excel and pandas: byte order mark, CRLF, quotes, separators at line ends, empty rows
    yield case("a byte order mark", bytes_of(table(), marked))
    yield case("line ends of Windows", bytes_of(table(), windows))
    yield case("empty rows at the end", table(change=lambda text: text + "\n\n"))
    quoted = table(change=lambda text: re.sub(r"[^,\n]+", r'"\g<0>"', text))
    yield case("quoted cells", quoted)
    trailing = table(change=lambda text: text.replace("\n", ",\n"))
    yield case("a separator at the end of each row", trailing)
    wide = bytes_of(table(), lambda data: data.decode().encode("utf-16"))
    yield case("UTF-16, as Excel's Unicode text", wide, "UTF-8")
    thousands = table("", factor=1e5, change=lambda text: re.sub(
        r"(?<=,)(-?\d{1,2})(\d{3})\.(\d\d)\d*", r'"\1,\2.\3"', text))  # fmt: skip
    yield case("separators of thousands", thousands, "expected a number")
    # numpy.savetxt writes "# " ahead of its header
    yield case("a header behind a #", table(change=lambda text: f"# {text}"), "--columns")

    # PlotJuggler/PlotJuggler#71, #46: its exports call the time __time and joints by their path
    def plot(head: str) -> str:
        names = [f"/joint_states/{name}/position" for name in NAMES]
        return ",".join(["__time", *names])

    exported = table(change=first_line(plot))
    yield case("an export of PlotJuggler", exported, "--columns")
    yield case("an export of PlotJuggler, --columns", exported, "unit of angles",
               columns={"time_s": "__time"})  # fmt: skip
    # ros2/rosbag2 and pandas: stamps in two columns, as dates, or not in the first column
    two = table(change=first_line(lambda head: head.replace("time_s", "sec,nanosec")))
    yield case("a stamp of seconds and nanoseconds", two, "--columns")
    dates = table(time="time", change=lambda text: re.sub(
        r"(?m)^(\d)\.(\d{6})\d*,", r"2024-05-01 12:00:0\1.\2,", text))  # fmt: skip
    yield case("dates as times", dates, r"line 2: time: expected a number.*2024-05-01")
    clock = table(time="time", change=lambda text: re.sub(r"(?m)^(\d)\.", r"00:00:0\1.", text))
    yield case("hours, minutes and seconds", clock, "line 2: time: expected a number")

    def turned(text: str) -> str:
        rows = [line.split(",") for line in text.splitlines()]
        return "\n".join(",".join([*row[1:], row[0]]) for row in rows) + "\n"

    yield case("time in the last column", table(change=turned), "--columns")
    yield case("time in the last column, --columns", table(change=turned),
               columns={"time_s": "time_s"})  # fmt: skip
    # units of the field: degree signs, cells with units, thousandths, turns, speeds
    yield case("angles in °", table("_deg", change=lambda text: text.replace("_deg", " [°]")))
    cells = table(change=lambda text: re.sub(r"(?m),(-?\d+\.\d+)$", r",\1°", text))
    yield case("a cell with its unit", cells, f"line 2: {NAMES[-1]}.*expected a number")
    for unit, size in (("mrad", 1e3), ("rev", 0.5 / np.pi), ("turns", 0.5 / np.pi)):
        yield case(f"angles in {unit}", table(f"_{unit}", factor=size), "unit|no joint|order")
    speeds = table(change=lambda text: text.replace("_deg", " [deg/s]"))
    yield case("speeds in place of angles", speeds, "unit|no joint|order")
    # loggers that are stopped and started again
    again = table(change=lambda text: text + text)
    yield case("two recordings in one file", again, "expected a number|time must increase")
    newest = table(change=lambda text: "\n".join(
        [text.splitlines()[0], *text.splitlines()[:0:-1]]))  # fmt: skip
    yield case("the newest row first", newest, "time must increase")
    repeated = table(change=lambda text: "\n".join(
        line for row in text.splitlines()
        for line in [row] * (1 + row.startswith("1.0"))))  # fmt: skip
    yield case("rows twice", repeated, "time must increase")
    comma = table(change=lambda text: "\n".join([*text.splitlines()[:20], "1.0,2"]))
    yield case("a last row that was cut", comma, motions.RIGHT | {"rows": 19, "duration_s": 0.9})


def points() -> Iterator[Case]:
    def case(statement: str, write: Write, answer: Any = grounds.RIGHT, **options: Any) -> Case:
        return Case("points", statement, write, grounds.read, answer, options)

    table = grounds.table
    z_first, y_first = POINTS[:, [2, 0, 1]], POINTS[:, [1, 0, 2]]
    # CloudCompare's ASCII export: "//X Y Z"; columns in any order, with colours
    yield case("a header of CloudCompare", table("a.xyz", "//X Y Z"))
    yield case("columns z,x,y", table("a.csv", "z,x,y", ",", points=z_first))
    yield case("columns Y X Z", table("a.xyz", "Y X Z", points=y_first))
    east = table("a.csv", "easting,northing,elevation", ",")
    yield case("columns easting,northing,elevation", east)
    north = table("a.csv", "northing,easting,elevation", ",", points=y_first)
    yield case("columns northing,easting,elevation", north)
    colours = np.c_[POINTS, np.full((len(POINTS), 3), 128.0)]
    coloured = table("a.csv", "x,y,z,r,g,b", ",", points=colours)
    yield case("colours behind the points", coloured)
    chosen = {"columns": {"x": "x", "y": "y", "z": "z"}}
    yield case("colours behind the points, --columns", coloured, **chosen)
    numbered = np.c_[np.arange(len(POINTS)), POINTS]
    survey = table("a.csv", "id,x,y,z", ",", points=numbered)
    yield case("numbers ahead of the points", survey)
    unknown = table("a.csv", "id,a,b,c", ",", points=numbered)
    yield case("four columns of unknown names", unknown, "--columns")
    yield case("numbers ahead of the points, --columns", survey, **chosen)
    yield case("numbers ahead, x y z by number", table("a.xyz", points=numbered),
               columns={"x": "2", "y": "3", "z": "4"})  # fmt: skip
    # surveys in feet and millimetres state it in the names
    for unit, size in (("ft", 1 / grounds.FOOT_M), ("mm", 1e3), ("cm", 100.0)):
        names = ",".join(f"{axis}_{unit}" for axis in "xyz")
        yield case(f"columns {names}", table("a.csv", names, ",", points=POINTS * size))
    yield case("columns x [m],y [m],z [m]", table("a.csv", "x [m],y [m],z [m]", ","))
    yield case("line ends of Windows", bytes_of(table("a.xyz"), windows))
    yield case("a byte order mark", bytes_of(table("a.csv", "x,y,z", ","), marked))
    # the number of points on the first line (PTS)
    counted = table("a.xyz", str(len(POINTS)))
    yield case("the number of points ahead", counted, "line 2|line 1|numbers")

    def vertices(folder: Path, order: str, more: str = "") -> Path:
        head = f"ply\nformat ascii 1.0\nelement vertex {len(POINTS)}\n"
        head += "".join(f"property double {name}\n" for name in order) + more + "end_header\n"
        cells = {"x": 0, "y": 1, "z": 2}
        rows = [" ".join(str(row[cells[name]]) for name in order) for row in POINTS]
        (folder / "a.ply").write_text(head + "\n".join(rows) + "\n")
        return folder / "a.ply"

    yield case("PLY, properties z y x", lambda folder: vertices(folder, "zyx"))

    def cloud(folder: Path) -> Path:
        file = grounds.pcd(folder)
        head, body = file.read_text().split("DATA ascii\n")
        rows = [" ".join(reversed(line.split())) for line in body.splitlines()]
        file.write_text(head.replace("FIELDS x y z", "FIELDS z y x") + "DATA ascii\n"
                        + "\n".join(rows) + "\n")  # fmt: skip
        return file

    yield case("PCD, fields z y x", cloud)

    # Wavefront OBJ: faces of four corners, colours of vertices, corners counted from the end
    def mesh(folder: Path, colour: str = "", back: bool = False) -> Path:
        cell = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
        a, b, c, d = (cell[i, j].ravel() for i, j in (
            (np.s_[:-1], np.s_[:-1]), (np.s_[:-1], np.s_[1:]), (np.s_[1:], np.s_[1:]),
            (np.s_[1:], np.s_[:-1])))  # fmt: skip
        first = -len(POINTS) if back else 1
        lines = [f"v {x} {y} {z}{colour}" for x, y, z in POINTS]
        lines += [" ".join(["f", *map(str, face)]) for face in np.c_[a, b, c, d] + first]
        (folder / "a.obj").write_text("\n".join(lines) + "\n")
        return folder / "a.obj"

    yield case("OBJ, faces of four corners", mesh, spacing_m=STEP_M)
    tinted = lambda folder: mesh(folder, " 0.5 0.5 0.5")  # noqa: E731
    yield case("OBJ, colours of vertices", tinted, spacing_m=STEP_M)
    yield case("OBJ, corners from the end", lambda folder: mesh(folder, back=True),
               spacing_m=STEP_M)  # fmt: skip


def rasters() -> Iterator[Case]:
    def case(kind: str, statement: str, write: Write, answer: Any = grounds.RIGHT, **options: Any):
        return Case(kind, statement, write, grounds.read, answer, options)

    grid, tif = grounds.grid, grounds.tif
    corner = {"xllcorner": 500000, "yllcorner": 4500000, "cellsize": STEP_M}
    holes = grounds.RIGHT | {"holes": 4}
    # OpenNHM/AvaFrame#425 and GDAL's AAIGrid driver: dx and dy in place of cellsize
    sides = {"xllcorner": 500000, "yllcorner": 4500000, "dx": STEP_M, "dy": STEP_M}
    yield case("grid", "dx and dy", grid(sides))
    # OSGeo/gdal#5095: a word as the void value; #9666: nan as a value
    word = bytes_of(grid(corner | {"NODATA_value": "null"}, -9999.0),
                    lambda data: data.replace(b"-9999.000000", b"null"))  # fmt: skip
    yield case("grid", "NODATA_value null", word, holes)
    nan = grid(corner | {"NODATA_value": "nan"}, np.nan)
    yield case("grid", "NODATA_value nan", nan, holes)
    loud = bytes_of(grid(corner), lambda data: data.replace(b"ncols", b"NCOLS   "))
    yield case("grid", "names in capitals, several blanks", loud)
    yield case("grid", "line ends of Windows", bytes_of(grid(corner), windows))
    comma = bytes_of(grid(corner), lambda data: data.replace(b".", b","))
    yield case("grid", "decimal commas", comma)

    def changed(change: Callable[[Any], None], **options: Any) -> Write:
        def write(folder: Path) -> Path:
            file = tif(unit="m", **options)(folder)
            with rasterio.open(file, "r+") as out:
                change(out)
            return file

        return write

    # GDAL raster data model: masks, alpha bands, AREA_OR_POINT, rotated grids
    nowhere = tif(unit="m", nodata=np.nan, void=np.nan)
    yield case("geotiff", "nodata nan", nowhere, holes)

    def mask(out: Any) -> None:
        seen = np.full((ROWS, COLUMNS), 255, np.uint8)
        seen[3, 5:9] = 0
        out.write_mask(seen)

    yield case("geotiff", "a mask", changed(mask), holes)
    point = changed(lambda out: out.update_tags(AREA_OR_POINT="Point"))
    yield case("geotiff", "AREA_OR_POINT Point", point)

    def rotate(out: Any) -> None:
        out.transform = Affine.translation(5e5, 4.5e6) * Affine.rotation(20.0) * Affine.scale(2, -2)

    yield case("geotiff", "a rotated grid", changed(rotate), "rotat|turned|north")
    yield case("geotiff", "complex numbers", tif(kind="complex64"), "complex|numbers|heights")


def bodies() -> Iterator[Case]:
    def case(kind: str, statement: str, write: Write, answer: Any = None, **options: Any) -> Case:
        right = tracks.right() if answer is None else answer
        return Case(kind, statement, write, tracks.read, right, options)

    # files that went through Windows
    for kind, name, writer in (
        ("qtm", "m.tsv", qtm), ("trc", "t.trc", trc), ("vicon", "v.csv", vicon),
        ("motive", "o.csv", motive),
    ):  # fmt: skip
        up = {"plane": "xy"} if kind in ("trc", "motive") else {}
        write = markers(name, writer)
        yield case(kind, "line ends of Windows", bytes_of(write, windows), **up)
        yield case(kind, "a byte order mark", bytes_of(write, marked), **up)
    # OpenSim: trailing tabs, units in full
    for unit, size in (("millimeters", 1.0), ("meters", 1e-3)):
        write = markers("t.trc", trc, change=lambda text, unit=unit: text.replace("\tmm\t",
                        f"\t{unit}\t"), size=size)  # fmt: skip
        yield case("trc", f"unit {unit}", write, plane="xy")
    tabs = markers("t.trc", trc, change=lambda text: text.replace("\n", "\t\n"))
    yield case("trc", "a tab at the end of each row", tabs, plane="xy")
    # frames of video players begin at 1, points of programs in C at 0
    shifted = midlines(change=lambda text: re.sub(
        r"(?m)^([\d.]+),(\d+),", lambda m: f"{m[1]},{int(m[2]) + 1},", text))  # fmt: skip
    yield case("midlines", "frames from 1", shifted)
    zero = midlines(change=lambda text: re.sub(
        r"(?m)^([\d.]+,\d+),(\d+),", lambda m: f"{m[1]},{int(m[2]) - 1},", text))  # fmt: skip
    yield case("midlines", "points from 0", zero)
    yield case("midlines", "line ends of Windows", bytes_of(midlines(), windows))
    yield case("midlines", "a byte order mark", bytes_of(midlines(), marked))
    capital = midlines(change=first_line(str.upper))
    yield case("midlines", "names in capitals", capital, "--columns")
    names = {"t": "T", "frame": "FRAME", "point": "POINT", "x_m": "X_M", "y_m": "Y_M"}
    yield case("midlines", "names in capitals, --columns", capital, columns=names)

    def skeleton(folder: Path) -> Path:
        bvh(folder / "a.bvh")
        file = folder / "a.bvh"
        file.write_bytes(windows(file.read_bytes()))
        return file

    yield case("bvh", "line ends of Windows", skeleton,
               {"rate_hz": RATE_HZ, "length_m": tracks.NO_SCALE,
                "frames": tracks.FRAMES})  # fmt: skip


def models() -> Iterator[Case]:
    def case(kind: str, statement: str, write: Write, answer: Any = robots.RIGHT, **options: Any):
        return Case(kind, statement, write, robots.read, answer, options)

    # google-deepmind/mujoco#3527: <mimic> is dropped without a word
    mimic = bytes_of(urdf(), lambda data: data.replace(
        b'velocity="3"/></joint><link', b'velocity="3"/></joint><link').replace(
        b'</joint>', b'<mimic joint="j0" multiplier="-1"/></joint>', 2).replace(
        b'<mimic joint="j0" multiplier="-1"/></joint>', b"</joint>", 1))  # fmt: skip
    yield case("urdf", "a joint that follows another", mimic, "mimic|follows")
    yield case("urdf", "an axis of length 2", urdf(axis="0 0 2"))
    yield case("urdf", "limits of 0 and 0", urdf(limit=(0.0, 0.0)),
               robots.RIGHT | {"limit_rad": 3.05})  # fmt: skip
    # urdfdom: a byte order mark, a declaration, comments
    said = b'<?xml version="1.0" encoding="utf-8"?>\n<!-- made by a program -->\n'
    yield case("urdf", "a byte order mark", bytes_of(urdf(), lambda data: marked(said + data)))
    yield case("urdf", "line ends of Windows", bytes_of(urdf(), windows))
    apart = urdf(root='<link name="alone"><visual><geometry><sphere radius="0.1"/></geometry>'
                 "</visual></link>")  # fmt: skip
    yield case("urdf", "a shape that no joint holds", apart)
    heavy = bytes_of(apart, lambda data: data.replace(
        b'"alone">', b'"alone"><inertial><mass value="1"/></inertial>'))  # fmt: skip
    yield case("urdf", "a mass that no joint holds", heavy, "one link must be the first")
    sliding = bytes_of(urdf(), lambda data: data.replace(b"revolute", b"prismatic", 1))
    yield case("urdf", "a joint that slides", sliding, "prismatic|slides|j0")
    missing = bytes_of(mjcf(), lambda data: data.replace(
        b"<worldbody>", b'<include file="parts.xml"/><worldbody>'))  # fmt: skip
    yield case("mjcf", "a missing included file", missing, "parts.xml")
    # osrf/sdformat#252 and sdformat 1.9: poses in degrees, or with a quaternion
    for form in ("degrees", "quat_xyzw"):
        yield case("sdf", f"poses in {form}", posed(form), robots.CHAIN)


def posed(form: str) -> Write:
    """Return what writes an SDF whose poses are in degrees, or have quaternions."""

    def pose(match: re.Match[str]) -> str:
        values = [float(word) for word in match[2].split()]
        if len(values) != 6 or "degrees" in match[1]:
            return match[0]
        turn = Rotation.from_euler("xyz", values[3:])
        said = 'degrees="true"' if form == "degrees" else 'rotation_format="quat_xyzw"'
        rest = turn.as_euler("xyz", degrees=True) if form == "degrees" else turn.as_quat()
        numbers = " ".join(f"{value:.15g}" for value in (*values[:3], *rest))
        return f"<pose{match[1]} {said}>{numbers}</pose>"

    def write(folder: Path) -> Path:
        file = robots.described(version="1.9", seed=1)(folder)
        text, count = re.subn(r"<pose([^>]*)>([^<]+)</pose>", pose, file.read_text())
        assert count > 3
        file.write_text(text)
        return file

    return write


def pairs() -> Iterator[Case]:
    case = next(robots.calibrations())

    def made(statement: str, write: Write, answer: Any = robots.BASELINE, **options: Any) -> Case:
        return Case("calibration", statement, write, case.read, answer, options)

    # ros-perception/image_pipeline: camera_info of one camera; ethz-asl/kalibr: camchain.yaml
    def text(name: str, words: str) -> Write:
        def write(folder: Path) -> Path:
            (folder / name).write_text(words)
            return folder / name

        return write

    info = "image_width: 320\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [400, 0, 160]\n"
    yield made("camera_info of one camera", text("c.yaml", info), "K1|YAML|read")
    chain = "cam0:\n  intrinsics: [400, 400, 160, 120]\ncam1:\n  T_cn_cnm1:\n  - [1, 0, 0, 0.1]\n"
    yield made("camchain of Kalibr", text("c.yaml", chain), "K1|YAML|read")
    yield made("line ends of Windows", bytes_of(calibration("yml", robots.NAMES[0], 1.0), windows))
    yield made("JSON with a byte order mark",
               bytes_of(calibration("json", robots.NAMES[0], 1.0), marked))  # fmt: skip


def cases() -> Iterator[Case]:
    """Yield the cases."""
    for group in (joints, points, rasters, bodies, models, pairs):
        yield from group()
