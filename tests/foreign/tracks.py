"""Files of bodies and markers: unit, rate, order, axes, gaps; and what is correct."""

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from snakewalk.config.reading import Facts
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import load_file
from tests.controller.track.readers import test_tierpsy as tierpsy
from tests.controller.track.readers.test_bvh import bvh
from tests.controller.track.readers.test_marker_tables import motive, qtm, trc, vicon
from tests.controller.track.readers.test_tracker_formats import dlc_csv, dlc_h5, sleap_h5, wcon
from tests.foreign.case import Case, Values
from tests.helpers.travelling import FRAMES, RATE_HZ, ends, wave_angles

ANGLES = wave_angles()
BODY = ends(ANGLES, 80.0)[:, ::10] + 200.0
BODY[..., 0] += 0.5 * np.arange(FRAMES)[:, None]
"""(60, 11, 2) millimetres."""
NODES = [f"p{k}" for k in range(11)]
NO_SCALE = -1.0
UNITS = {"m": 1e-3, "mm": 1.0, "cm": 0.1}
LENGTH_M = 0.08
MOST_ERROR_RAD = 0.06
"""Error of the angles of a body of eleven points."""
Write = Callable[[Path], Path]


def right(length_m: float = LENGTH_M, rate_hz: float = RATE_HZ, frames: int = FRAMES) -> Values:
    return {"rate_hz": rate_hz, "length_m": length_m, "frames": frames, "error_rad": 0.0}


def read(file: Path, options: dict[str, Any]) -> tuple[Values, Facts]:
    track = load_file(file, choice=Choice(**options))
    numbers = np.rint(track.time_s * track.rate_hz * track.every).astype(int)
    if numbers[-1] >= FRAMES:  # every row is a frame of the body, numbered by a faster camera
        numbers //= track.every
    error = np.abs(track.angles_rad - ANGLES[numbers])[:, 5:-5].max()
    if track.length_m is not None and abs(track.length_m / LENGTH_M - 1.0) < 3e-3:
        length_m = LENGTH_M  # of eleven points of a wave
    else:
        length_m = NO_SCALE if track.length_m is None else track.length_m
    values = {
        "rate_hz": track.rate_hz,
        "length_m": length_m,
        "frames": track.frames,
        "error_rad": 0.0 if error < MOST_ERROR_RAD else error,
        "absent": track.absent,
    }
    return values, track.facts


def midlines(
    columns: tuple[str, str] = ("x_m", "y_m"), size: float = 1e-3, second: float = 1.0,
    separator: str = ",", comma: bool = False, kept: list[int] | None = None, void: str = "",
    shuffled: bool = False, animals: tuple[str, ...] = (), rate_hz: float = RATE_HZ,
    change: Callable[[str], str] = str,
) -> Write:  # fmt: skip
    def write(folder: Path) -> Path:
        head = ["t", "frame", "point", *columns, *(["animal"] if animals else [])]
        rows = []
        for name in animals or ("",):
            for k in range(FRAMES) if kept is None else kept:
                for point, (x, y) in enumerate(BODY[k] * size):
                    cells = [f"{second * k / rate_hz:.9f}", str(k), str(point + 1)]
                    cells += [f"{x:.9f}", f"{y:.9f}"]
                    if void and k == 7 and point == 3:
                        cells[3:] = [void, void]
                    rows.append([cell.replace(".", ",") for cell in cells] if comma else cells)
                    rows[-1] += [name] if animals else []
        if shuffled:
            np.random.default_rng(0).shuffle(rows)
        file = folder / "bodies.csv"
        file.write_text(change("\n".join(separator.join(row) for row in [head, *rows]) + "\n"))
        return file

    return write


def worms(
    units: dict[str, str] | None = None, sizes: tuple[float, float, float] = (1.0, 1.0, 1.0),
    head: str | None = None, shift: float = 0.0, several: bool = False, whole: bool = False,
) -> Write:  # fmt: skip
    def write(folder: Path) -> Path:
        text = wcon()
        for k, record in enumerate(text["data"]):
            x, y = BODY[k].T
            if head == "R":
                x, y = x[::-1], y[::-1]
            record["t"] = sizes[0] * k / RATE_HZ
            record["x"] = list(sizes[1] * (x - shift))
            record["y"] = list(sizes[2] * (y - shift))
            record.update({"head": head} if head else {})
            record.update({"ox": sizes[1] * shift, "oy": sizes[2] * shift} if shift else {})
        if several:
            text["data"] += [record | {"id": "2"} for record in text["data"]]
        if whole:
            each = text["data"]
            text["data"] = {"id": "1"} | {key: [r[key] for r in each] for key in ("t", "x", "y")}
        text["units"] = {"t": "s", "x": "mm", "y": "mm"} | (units or {})
        if shift:
            text["units"] |= {"ox": text["units"]["x"], "oy": text["units"]["y"]}
        file = folder / "worm.wcon"
        file.write_text(json.dumps(text))
        return file

    return write


def spaced(up: str, void: str, size: float = 1.0, lost: bool = False) -> np.ndarray:
    """(T, 11, 3) markers whose ground is across ``up``; one frame is void if ``lost``."""
    x, y = np.moveaxis(size * BODY, 2, 0)
    flat = np.full_like(x, 7.0 * size)
    axes = {"z": (x, y, flat), "y": (x, flat, -y), "x": (flat, x, y)}[up]
    space = np.stack(axes, axis=2)
    if lost:
        space[7] = 0.0 if void == "0" else np.nan
    return space


def markers(
    name: str, writer: Callable[..., None], up: str = "z", change: Callable[[str], str] = str,
    void: str = "", size: float = 1.0, lost: bool = False,
) -> Write:  # fmt: skip
    """Return what writes a table of markers by one of the writers of flat bodies."""

    def write(folder: Path) -> Path:
        file = folder / name
        writer(file, NODES, BODY, "")
        separator = "," if file.suffix == ".csv" else "\t"
        lines = file.read_text().splitlines()
        rows = [k for k, line in enumerate(lines) if line.count("7.0000") >= 11]
        for k, places in zip(rows, spaced(up, void, size, lost).reshape(FRAMES, -1), strict=True):
            cells = lines[k].split(separator)
            texts = [void if np.isnan(v) else f"{v:.6f}" for v in places]
            lines[k] = separator.join([*cells[: len(cells) - len(texts)], *texts])
        file.write_text(change("\n".join(lines) + "\n"))
        return file

    return write


def files(name: str, writer: Callable[..., None], *given: Any, **options: Any) -> Write:
    def write(folder: Path) -> Path:
        writer(folder / name, *given, **options)
        return folder / name

    return write


def changed(write: Write, *pairs: tuple[str, str]) -> Write:
    def write_changed(folder: Path) -> Path:
        file = write(folder)
        text = file.read_text()
        for old, new in pairs:
            assert re.search(old, text, re.MULTILINE), old
            text = re.sub(old, new, text, flags=re.MULTILINE)
        file.write_text(text)
        return file

    return write_changed


def c3d(unit: str, rate_hz: float, up: str = "z", screen: str = "") -> Write:
    def write(folder: Path) -> Path:
        import ezc3d

        file = ezc3d.c3d()
        point = file["parameters"]["POINT"]
        point["RATE"]["value"], point["UNITS"]["value"] = [rate_hz], [unit]
        point["LABELS"]["value"] = NODES
        if screen:
            file.add_parameter("POINT", "Y_SCREEN", [screen])
        data = np.ones((4, len(NODES), FRAMES))
        data[:3] = spaced(up, "", UNITS.get(unit, 1.0)).transpose(2, 1, 0)
        file["data"]["points"] = data
        file.write(str(folder / "m.c3d"))
        return folder / "m.c3d"

    return write


def arrays(name: str, **values: Any) -> Write:
    def write(folder: Path) -> Path:
        file = folder / name
        savemat(file, values) if file.suffix == ".mat" else np.savez(file, **values)
        return file

    return write


def tables() -> Iterator[Case]:
    def case(statement: str, write: Write, answer: Any, kind: str = "midlines", **options: Any):
        return Case(kind, statement, write, read, answer, options)

    for columns, size, length_m in (
        (("x_m", "y_m"), 1e-3, LENGTH_M), (("x_mm", "y_mm"), 1.0, LENGTH_M),
        (("mxmm", "mymm"), 1.0, LENGTH_M), (("x_px", "y_px"), 4.0, NO_SCALE),
        (("x_lengths", "y_lengths"), 1 / 80, NO_SCALE),
    ):  # fmt: skip
        yield case(f"columns {columns[0]}", midlines(columns, size), right(length_m))
    for separator, comma in ((";", False), ("\t", False), (";", True), ("\t", True)):
        words = f"separator {separator!r}{', decimal commas' * comma}"
        yield case(words, midlines(separator=separator, comma=comma), right())
    for unit, second in (("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
        yield case(f"t in {unit}", midlines(second=second), f"--time-unit {unit}")
        write = midlines(second=second)
        yield case(f"t in {unit}, --time-unit", write, right(), time_unit=unit)
    for rate_hz in (5.0, 25.0, 120.0, 500.0):
        yield case(
            f"{rate_hz:g} frames a second", midlines(rate_hz=rate_hz), right(rate_hz=rate_hz)
        )
    few = [k for k in range(FRAMES) if not 20 <= k < 29]
    yield case("nine frames are missing", midlines(kept=few), right(frames=51) | {"absent": 9})
    third = list(range(0, FRAMES, 3))
    yield case("every third frame", midlines(kept=third), right(rate_hz=RATE_HZ / 3, frames=20))
    for void in ("NA", "nan", "null", "-"):
        yield case(f"{void} for a missing point", midlines(void=void), right(frames=59))
    yield case("rows in another order", midlines(shuffled=True), right())
    yield case("--rate", midlines(), right(rate_hz=50.0), rate=50.0)
    two = midlines(animals=("eel", "other"))
    yield case("two animals", two, "2 animals in it.*--individual")
    yield case("two animals, --individual", two, right(), individual="eel")
    same = midlines(change=lambda text: text + "\n".join(text.splitlines()[1:]) + "\n")
    yield case("each row twice", same, "a point twice in a frame")
    yield case("feet", midlines(("x_ft", "y_ft"), 1 / 304.8), right())
    for unit, size in (("cm", 0.1), ("um", 1e3), ("in", 1 / 25.4)):
        write = midlines((f"x_{unit}", f"y_{unit}"), size)
        yield case(f"columns x_{unit}", write, right())
    unknown = midlines(("x_cubits", "y_cubits"), 1 / 457.2)
    yield case("columns x_cubits", unknown, "expected t, frame, point")

    for statement, write, length_m in (
        ("t in ms", worms({"t": "ms"}, (1e3, 1, 1)), LENGTH_M),
        ("t in minutes", worms({"t": "min"}, (1 / 60, 1, 1)), LENGTH_M),
        ("t in milliseconds", worms({"t": "milliseconds"}, (1e3, 1, 1)), LENGTH_M),
        ("lengths in m", worms({"x": "m", "y": "m"}, (1, 1e-3, 1e-3)), LENGTH_M),
        ("lengths in um", worms({"x": "um", "y": "um"}, (1, 1e3, 1e3)), LENGTH_M),
        ("lengths in µm", worms({"x": "µm", "y": "µm"}, (1, 1e3, 1e3)), LENGTH_M),
        ("lengths in cm", worms({"x": "cm", "y": "cm"}, (1, 0.1, 0.1)), LENGTH_M),
        ("lengths in inches", worms({"x": "in", "y": "in"}, (1, 1 / 25.4, 1 / 25.4)), LENGTH_M),
        ("lengths in micrometres", worms({"x": "micrometres", "y": "micrometres"}, (1, 1e3, 1e3)),
         LENGTH_M),
        ("x in mm and y in m", worms({"y": "m"}, (1, 1, 1e-3)), LENGTH_M),
        ("x in um and y in cm", worms({"x": "um", "y": "cm"}, (1, 1e3, 0.1)), LENGTH_M),
        ("head left", worms(head="L"), LENGTH_M),
        ("head right", worms(head="R"), LENGTH_M),
        ("an origin of each frame", worms(shift=150.0), LENGTH_M),
        ("an origin in m", worms({"x": "m", "y": "m"}, (1, 1e-3, 1e-3), shift=150.0), LENGTH_M),
        ("one record with lists", worms(whole=True), LENGTH_M),
    ):  # fmt: skip
        yield case(statement, write, right(length_m), "wcon")
    pixels = worms({"x": "1", "y": "1"})
    yield case("lengths without a unit", pixels, right(NO_SCALE), "wcon")
    yield case("two animals", worms(several=True), "--individual", "wcon")
    yield case("two animals, --individual", worms(several=True), right(), "wcon", individual="1")
    yield case("no unit of t", worms({"t": ""}), "expected a time, such as s", "wcon")
    yield case("x a length and y not", worms({"y": "1"}), "some are lengths", "wcon")
    wrong = worms({"t": "mm"})
    yield case("a length as the unit of t", wrong, "expected a time, such as s", "wcon")

    for name, write in (
        ("DeepLabCut CSV", files("a.csv", dlc_csv)), ("DeepLabCut HDF5", files("a.h5", dlc_h5)),
        ("DeepLabCut, named animal", files("a.csv", dlc_csv, individuals="eel")),
        ("SLEAP analysis", files("a.h5", sleap_h5)),
    ):  # fmt: skip
        yield case(f"{name}, no rate", write, right(NO_SCALE, 30.0), "tracker")
        yield case(f"{name}, --rate", write, right(NO_SCALE), "tracker", rate=RATE_HZ)
    yield case("SLEAP, two animals", files("a.h5", sleap_h5, animals=2), "--individual", "tracker")
    unsure = np.full(BODY.shape[:2], 0.99)
    unsure[10:20] = 0.1
    doubt = files("a.csv", dlc_csv, likelihood=unsure)
    yield case("ten frames of low likelihood", doubt, right(NO_SCALE, 30.0, 50), "tracker")
    yield case("--min-score 0", doubt, right(NO_SCALE, 30.0), "tracker", min_score=0.0)

    body = BODY / 1000.0
    yield case("npz, all stated", arrays("a.npz", points=body, rate_hz=RATE_HZ, length_m=LENGTH_M),
               right(), "arrays")  # fmt: skip
    yield case("npz, no length", arrays("a.npz", points=body / LENGTH_M, rate_hz=RATE_HZ,
               length_m=np.nan), right(NO_SCALE), "arrays")  # fmt: skip
    holes = body.copy()
    holes[5] = np.nan
    yield case("npz, a frame of NaN", arrays("a.npz", points=holes, rate_hz=RATE_HZ,
               length_m=LENGTH_M), right(frames=59), "arrays")  # fmt: skip
    for ending in ("npz", "mat"):
        skeletons = arrays(f"a.{ending}", skeletons=BODY * [1.0, -1.0])
        yield case(
            f"{ending}, skeletons without a rate", skeletons, right(NO_SCALE, 30.0), "arrays"
        )
    for rate_hz in (20.0, 50.0):
        mat = arrays("a.mat", points=body, rate_hz=rate_hz, length_m=LENGTH_M)
        yield case(f"mat, {rate_hz:g} Hz", mat, right(rate_hz=rate_hz), "arrays")


def worm_cases() -> Iterator[Case]:
    def read_worm(file: Path, options: dict[str, Any]) -> tuple[Values, Facts]:
        track = load_file(file, choice=Choice(individual="2", **options))
        length_m = NO_SCALE if track.length_m is None else round(1e3 * track.length_m, 2)
        return {"rate_hz": track.rate_hz, "length_mm": length_m}, track.facts

    frames = {"time_units": "frames", "expected_fps": 1}
    pixels = {"microns_per_pixel": 1.0, "xy_units": "pixels"}
    for is_features in (True, False):
        name = "features" if is_features else "skeletons"
        for statement, states, answer, options in (
            ("all stated", {}, {"rate_hz": 25.0, "length_mm": 1.1}, {}),
            ("50 frames a second", {"fps": 50.0}, {"rate_hz": 50.0, "length_mm": 1.1}, {}),
            ("times in frames", frames, "states no frame rate", {}),
            ("times in frames, --rate", frames, {"rate_hz": 30.0, "length_mm": 1.1},
             {"rate": 30.0}),
            ("places in pixels", pixels, {"rate_hz": 25.0, "length_mm": NO_SCALE}, {}),
        ):  # fmt: skip
            write = files("w.hdf5", tierpsy.write, is_features=is_features,
                          states=tierpsy.STATES | states)  # fmt: skip
            yield Case("tierpsy", f"{name}, {statement}", write, read_worm, answer, options)


def marker_cases() -> Iterator[Case]:
    def case(kind: str, statement: str, write: Write, answer: Any, **options: Any) -> Case:
        return Case(kind, statement, write, read, answer, options)

    names = {"qtm": ("m.tsv", qtm, "z"), "vicon": ("v.csv", vicon, "z"),
             "trc": ("t.trc", trc, "yz"), "motive": ("o.csv", motive, "yz")}  # fmt: skip
    planes = {"z": "xy", "y": "xz", "x": "yz"}
    for kind, (name, writer, usual) in names.items():
        for up, plane in planes.items():
            write = markers(name, writer, up)
            answer = right() if up in usual else "which axis points up.*--plane"
            yield case(kind, f"{up} points up", write, answer)
            yield case(kind, f"{up} points up, --plane", write, right(), plane=plane)
        for void in ("NA", "", "NaN", "0"):
            write = markers(name, writer, void=void, lost=True)
            yield case(kind, f"{void or 'nothing'} for missing markers", write, right(frames=59))
        write = markers(name, writer)
        yield case(kind, "--rate", write, right(rate_hz=50.0), rate=50.0)
        order = tuple(NODES[::-1])
        turned = markers(name, writer)
        yield Case(kind, "--keypoints", turned, _turned, {"error_rad": 0.0}, {"keypoints": order})
        cut = changed(write, (r"^(2[1-9])([,\t].*\n)", ""))
        cut = changed(cut, ("\t60\t11", "\t51\t11")) if kind == "trc" else cut
        if kind != "qtm":
            yield case(kind, "nine frames are missing", cut, right(frames=51) | {"absent": 9})
    for rate_hz in (10.0, 60.0, 240.0):
        shown = right(rate_hz=rate_hz)
        rate = (rf"FREQUENCY\t{RATE_HZ}", f"FREQUENCY\t{rate_hz}")
        yield case("qtm", f"{rate_hz:g} Hz", changed(markers("m.tsv", qtm), rate), shown)
        rate = (r"(Trajectories\n)20\n", rf"\g<1>{rate_hz:g}\n")
        yield case("vicon", f"{rate_hz:g} Hz", changed(markers("v.csv", vicon), rate), shown)
        rate = (r"^20\t20", f"{rate_hz:g}\t{rate_hz:g}")
        yield case("trc", f"{rate_hz:g} Hz", changed(markers("t.trc", trc), rate), shown)
    for unit, size in UNITS.items():
        write = changed(markers("v.csv", vicon, size=size), (r"\bmm\b", unit))
        yield case("vicon", f"unit {unit}", write, right())
        write = changed(markers("t.trc", trc, size=size), (r"\tmm\t", f"\t{unit}\t"))
        yield case("trc", f"unit {unit}", write, right())
        word = {"m": "Meters", "mm": "Millimeters", "cm": "Centimeters"}[unit]
        for version in ("1.22", "1.23", "1.25"):
            write = changed(markers("o.csv", motive, "y", size=size),
                            ("Millimeters", word), (r"1\.24", version))  # fmt: skip
            yield case("motive", f"{word}, version {version}", write, right())
    for unit, metres in (("ft", 0.3048), ("in", 0.0254)):
        size = 1e-3 / metres
        write = changed(markers("v.csv", vicon, size=size), (r"\bmm\b", unit))
        yield case("vicon", f"unit {unit}", write, right())
        write = changed(markers("t.trc", trc, size=size), (r"\tmm\t", f"\t{unit}\t"))
        yield case("trc", f"unit {unit}", write, right())
    for unit in ("px", "units"):
        write = changed(markers("v.csv", vicon), (r"\bmm\b", unit))
        yield case("vicon", f"unit {unit}", write, f"its unit is '{unit}'; expected one of m, cm")
        write = changed(markers("t.trc", trc), (r"\tmm\t", f"\t{unit}\t"))
        yield case("trc", f"unit {unit}", write, f"its unit is '{unit}'; expected one of m, cm")
    yield case("c3d", "no unit", c3d("", RATE_HZ), right(NO_SCALE))
    write = changed(markers("v.csv", vicon), ("^,,mm,mm,mm", ",,mm,mm,m"))
    yield case("vicon", "two units", write, "expected one unit for all")
    more = changed(markers("t.trc", trc), ("\t60\t11", "\t80\t11"))
    yield case("trc", "fewer rows than stated", more, "states NumFrames 80")
    yield case("trc", "no rate", changed(markers("t.trc", trc), (r"^20\t20", "0\t20")),
               "states no DataRate; give --rate")  # fmt: skip
    local = changed(markers("o.csv", motive, "y"), ("Global", "Local"))
    yield case("motive", "places in the frame of a parent", local, "export it in Global")
    rates = changed(markers("o.csv", motive, "y"), ("Frame Rate,", "Frame Rate,7"))
    yield case("motive", "rates that its times contradict", rates, "give --rate")
    for frames, rate_hz in ((4, RATE_HZ), (2, RATE_HZ)):
        counted = changed(markers("o.csv", motive, "y"))
        yield case("motive", f"frames of a camera {frames} times as fast", _camera(counted, frames),
                   right(rate_hz=rate_hz))  # fmt: skip
    first = ("Type,Rigid Body" + ",Rigid Body" * 6, "Type" + ",Force" * 7)
    bodies = changed(markers("o.csv", motive, "y"), ("(?<=,)Marker", "Rigid Body"), first)
    yield case("motive", "rigid bodies only", bodies, right())
    for unit in UNITS:
        yield case("c3d", f"unit {unit}", c3d(unit, RATE_HZ), right())
    for up in "zy":
        yield case(
            "c3d", f"Y_SCREEN +{up.upper()}", c3d("mm", RATE_HZ, up, f"+{up.upper()}"), right()
        )
    yield case("c3d", "y points up, not stated", c3d("mm", RATE_HZ, "y"), "--plane")
    yield case("c3d", "y points up, --plane", c3d("mm", RATE_HZ, "y"), right(), plane="xz")
    for rate_hz in (50.0, 100.0):
        yield case("c3d", f"{rate_hz:g} Hz", c3d("mm", rate_hz), right(rate_hz=rate_hz))
    skeleton = files("a.bvh", bvh)
    yield case("bvh", "all stated but the length", skeleton, right(NO_SCALE))
    yield case("bvh", "a joint beside the chain", files("a.bvh", bvh, jaw=True), right(NO_SCALE))
    for step_s in (0.01, 1 / 30):
        write = changed(skeleton, ("Frame Time: 0.05", f"Frame Time: {step_s}"))
        yield case("bvh", f"Frame Time {step_s:.3f}", write, right(NO_SCALE, 1 / step_s))
    order = changed(skeleton, ("Zrotation Xrotation Yrotation", "Xrotation Zrotation Yrotation"))
    yield case("bvh", "another order of channels", order, right(NO_SCALE))
    doubled = changed(skeleton, ("OFFSET -5 0 0", "OFFSET -50 0 0"))
    yield case("bvh", "offsets in another unit", doubled, right(NO_SCALE))


def _camera(write: Write, frames: int) -> Write:
    """Rows carry the numbers of a faster camera's frames."""

    def write_counted(folder: Path) -> Path:
        file = write(folder)
        text = file.read_text().replace(f"Capture Frame Rate,{4 * RATE_HZ:.6f}",
                                        f"Capture Frame Rate,{frames * RATE_HZ:.6f}")  # fmt: skip
        text = re.sub(r"^(\d+),", lambda m: f"{frames * int(m[1])},", text, flags=re.MULTILINE)
        file.write_text(text)
        return file

    return write_counted


def _turned(file: Path, options: dict[str, Any]) -> tuple[Values, Facts]:
    """Read a body tail first: the tangents point the other way."""
    track = load_file(file, choice=Choice(**options))
    error = np.angle(np.exp(1j * (track.angles_rad[:, ::-1] + np.pi - ANGLES)))[:, 5:-5]
    largest = float(np.abs(error).max())
    return {"error_rad": 0.0 if largest < MOST_ERROR_RAD else largest}, track.facts


def cases() -> Iterator[Case]:
    """Yield the cases."""
    yield from tables()
    yield from worm_cases()
    yield from marker_cases()
