"""Files of joint angles: unit, time, order, gaps, sources; and what is correct."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.loader import load_robot
from snakewalk.config.playback import JointRequest
from snakewalk.config.reading import Facts
from snakewalk.controller.run.kinds.playback_run import foreign_joints
from snakewalk.controller.track.readers.load import load_file
from tests.controller.exchange.joint_motions.test_joint_motions import bag, dataset
from tests.foreign.case import Case, Values

ROBOT = load_robot("yaw16")
NAMES = ROBOT.joint_names
RATE_HZ, ROWS = 20.0, 60
TIME_S = np.arange(ROWS) / RATE_HZ
RIGHT = {"duration_s": TIME_S[-1], "error_rad": 0.0, "rows": ROWS}
UNITS = {
    "_rad": 1.0, " [rad]": 1.0, " (radians)": 1.0, "_radians": 1.0,
    "_deg": np.degrees(1.0), " [deg]": np.degrees(1.0), " (degrees)": np.degrees(1.0),
    ".degrees": np.degrees(1.0),
}  # fmt: skip
TIMES = {
    "time_s": 1.0, "t_s": 1.0, "timestamp [s]": 1.0, "seconds": 1.0, "time_ms": 1e3,
    "t (ms)": 1e3, "timestamp_us": 1e6, "time [ns]": 1e9,
}  # fmt: skip


def true_rad(time_s: np.ndarray) -> np.ndarray:
    """(T, 16) joint angles of the motion in every file."""
    return 0.3 * np.sin(2.0 * np.pi * (0.5 * time_s[:, None] - np.arange(len(NAMES)) / 10.0))


def read(file: Path, options: dict[str, Any]) -> tuple[Values, Facts]:
    motion = foreign_joints(str(file), ROBOT, JointRequest(**options))
    if motion is None:  # as `play` goes on
        load_file(file)
    assert motion is not None
    # a second publisher begins later, by one row at most
    errors = [
        np.abs(motion.joint_rad - true_rad(motion.time_s + k / RATE_HZ)).max() for k in (0, 1)
    ]
    rows = len(motion.time_s)
    values = {"duration_s": motion.time_s[-1], "error_rad": min(errors), "rows": rows}
    return values, motion.facts


def table(
    angle: str = "_deg", time: str = "time_s", separator: str = ",", comma: bool = False,
    names: tuple[str, ...] = NAMES, kept: np.ndarray | None = None, void: str = "",
    factor: float | None = None, start_s: float = 0.0, time_factor: float | None = None,
    change: Callable[[str], str] = str, mixed: int | None = None,
) -> Callable[[Path], Path]:  # fmt: skip
    """Return what writes a table of the motion."""

    def write(folder: Path) -> Path:
        size = UNITS.get(angle, np.degrees(1.0)) if factor is None else factor
        second = TIMES.get(time, 1.0) if time_factor is None else time_factor
        values = true_rad(TIME_S) * size
        rows = [[time, *(f"{name}{angle}" for name in names)]]
        if mixed is not None:
            values[:, mixed] /= size
            rows[0][1 + mixed] = f"{names[mixed]}_rad"
        for k in range(ROWS) if kept is None else np.flatnonzero(kept):
            cells = [f"{second * (TIME_S[k] + start_s):.9f}", *(f"{v:.7f}" for v in values[k])]
            if void and k % 10 == 3:
                cells[5] = void
            rows.append([cell.replace(".", ",") for cell in cells] if comma else cells)
        file = folder / "angles.csv"
        file.write_text(change("\n".join(separator.join(row) for row in rows) + "\n"))
        return file

    return write


def bags(**options: Any) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        bag(folder / "b.mcap", **options)
        return folder / "b.mcap"

    return write


def datasets(**options: Any) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        dataset(folder / "set", **options)
        return folder / "set"

    return write


def without(first: int, last: int) -> np.ndarray:
    return ~((np.arange(ROWS) >= first) & (np.arange(ROWS) < last))


def cases() -> Iterator[Case]:
    """Yield the cases."""

    def case(statement: str, write: Any, answer: Any = RIGHT, kind: str = "joints", **options: Any):
        return Case(kind, statement, write, read, answer, options)

    for angle in UNITS:
        for time in TIMES:
            yield case(f"angles{angle}, times {time}", table(angle, time))
    for separator, comma in ((";", False), ("\t", False), (";", True), ("\t", True)):
        for angle in ("_rad", "_deg"):
            words = f"separator {separator!r}{', decimal commas' * comma}, angles{angle}"
            yield case(words, table(angle, separator=separator, comma=comma))
    for start_s in (0.0, 3.5, 1000.0, 1.7e9):
        yield case(f"times begin at {start_s:g} s", table(start_s=start_s))
    turned = RIGHT | {"error_rad": 0.0}
    numbered = tuple(f"joint_{k + 1}" for k in range(16))
    yield case("names of one stem, numbers from 1", table(names=numbered), turned)
    yield case("numbers from 0", table(names=tuple(f"q{k}" for k in range(16))), turned)
    for word in ("NA", "nan", "null", "-", "NaN"):
        yield case(f"{word} for a missing value", table(void=word), RIGHT | {"rows": ROWS - 6})
    yield case("rows are missing", table(kept=without(20, 25)), RIGHT | {"rows": ROWS - 5})
    yield case("a gap of 1 s", table(kept=without(20, 40)), RIGHT | {"rows": ROWS - 20})
    every = np.arange(ROWS) % 3 == 0
    yield case("every third row", table(kept=every), {"error_rad": 0.0, "rows": 20})
    for unit, size in (("deg", np.degrees(1.0)), ("rad", 1.0)):
        plain = table("", factor=size)
        yield case(f"no unit of angles, values in {unit}", plain, "states no unit of angles")
        yield case(f"no unit of angles, --unit {unit}", plain, unit=unit)
        other = "rad" if unit == "deg" else "deg"
        yield case(
            f"angles in {unit}, --unit {other}", table(f"_{unit}"), f"states {unit}", unit=other
        )
    ticks = table("", factor=2048 / np.pi)
    yield case("ticks of a servo without a unit", ticks, "states no unit of angles")
    for unit, size in (("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
        for column in ("time", "timestamp", "t"):
            write = table(time=column, time_factor=size)
            yield case(f"column {column} without a unit, in {unit}", write, f"--time-unit {unit}")
            yield case(f"column {column} in {unit}, --time-unit", write, time_unit=unit)
    for column in ("time", "timestamp", "t"):
        yield case(f"column {column} without a unit, in s", table(time=column))
    for other in ("ms", "us"):
        yield case(f"time_s, --time-unit {other}", table(), "states s; leave", time_unit=other)
    yield case("one column in rad, the others in deg", table(mixed=2))
    partly = table(change=lambda text: text.replace("yaw_03_deg", "yaw_03", 1))
    yield case(
        "one column states no unit", partly, "column yaw_03 states no unit of angles, and others do"
    )
    twice = table(names=(NAMES[0], NAMES[0], *NAMES[2:]))
    yield case("a name twice", twice, f"joint {NAMES[0]} is there twice")
    back = table(change=lambda text: "\n".join([*text.splitlines()[:9], *text.splitlines()[4:]]))
    yield case("times go back", back, "time must increase")
    alone = table(names=tuple("abcdefghijklmnop"))
    yield case("names without an order", alone, "do not state their order")
    fewer = table(names=NAMES[:15])
    yield case("a column without a name", fewer, "cells, the first line names")
    asked = dict(zip(NAMES, "abcdefghijklmnop", strict=True))
    yield case("names without an order, --joint", alone, joints=asked)
    stems = tuple(f"left{k}" for k in range(8)) + tuple(f"right{k}" for k in range(8))
    yield case("names of two stems", table(names=stems), "do not state their order")

    ros = RIGHT
    for start in (0.0, 7.0, 1.7e9):
        yield case(f"bag, stamps from {start:g} s", bags(start_s=start), ros)
    yield case("bag, one trajectory", bags(trajectory=True), ros)
    order = tuple(f"joint_{k}" for k in sorted(range(1, 17), key=str))
    alphabetical = bags(joints=order)
    yield Case(
        "joints", "bag, names in the order of the alphabet", alphabetical, _alphabetical, ros
    )
    two = (slice(0, 8), slice(8, 16))
    yield case("bag, two publishers", bags(publishers=two), {"error_rad": 0.0})
    yield case("bag, a gripper first", bags(fingers=(0.0, 0.02)), ros)
    yield case("bag, a gripper between", bags(fingers=(0.5, 0.7)), ros)
    both = bags(publishers=two, fingers=(0.0, 0.05), start_s=0.0)
    yield case("bag, two publishers and a gripper from 0 s", both, {"error_rad": 0.0})
    for version in ("v2.1", "v3.0"):
        unasked = datasets(version=version)
        yield case(
            f"{version}, two episodes", unasked, "give --episode", kind="lerobot", unit="rad"
        )
        yield case(f"{version}, no unit", unasked, "states no unit", kind="lerobot", episode=0)
        for unit, size in (("rad", 1.0), ("deg", np.degrees(1.0))):
            made = datasets(version=version, unit=size)
            yield case(f"{version}, --unit {unit}", made, kind="lerobot", episode=0, unit=unit)


def _alphabetical(file: Path, options: dict[str, Any]) -> tuple[Values, Facts]:
    """Read a bag whose columns are those of the angles in the order of the alphabet."""
    motion = foreign_joints(str(file), ROBOT, JointRequest(**options))
    assert motion is not None
    column = np.argsort(np.argsort([str(k) for k in range(1, 17)]))
    error = np.abs(motion.joint_rad - true_rad(motion.time_s)[:, column]).max()
    values = {"duration_s": motion.time_s[-1], "error_rad": error, "rows": len(motion.time_s)}
    return values, motion.facts
