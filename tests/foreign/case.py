"""A generated file that differs from its neighbour in one statement, and its judgement."""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.config.reading import Facts

Values = Mapping[str, float]
Read = Callable[[Path, dict[str, Any]], tuple[Values, Facts]]
TOLERANCE: Final = 2e-3
"""Share of a value, and absolute error of values near 0."""
SOURCES: Final = {
    "joints": "names and units of columns as people write them in public issues of ros2/rosbag2 "
    "and PlotJuggler; `sensor_msgs/JointState` (radians, stamps, any order of names)",
    "lerobot": "LeRobot dataset format 2.1 and 3.0 (meta/info.json, fps, episode_index)",
    "midlines": "docs/recordings.md of this project; issues of DeepLabCut and movement on t, fps",
    "wcon": "WCON specification (openworm/tracker-commons): units, head, ox, several records",
    "tierpsy": "Tierpsy docs/OUTPUTS.md and read_attrs.py: xy_units, time_units, microns_per_pixel",
    "tracker": "layouts of DeepLabCut's and SLEAP's exports",
    "qtm": "QTM manual, TSV export: FREQUENCY, MARKER_NAMES, 0 or empty for a missing marker",
    "vicon": "Vicon Nexus, ASCII export: blocks, rate below Trajectories, row of units",
    "trc": "OpenSim documentation, marker (.trc) files: DataRate, OrigDataRate, Units, NumFrames",
    "motive": "docs.optitrack.com, Data Export: CSV, and C3D (Motive is Y-up, right-handed)",
    "c3d": "c3d.org user guide: POINT:UNITS, POINT:RATE, POINT:X_SCREEN, POINT:Y_SCREEN",
    "bvh": "Biovision hierarchy: OFFSET, CHANNELS in any order, Frame Time",
    "arrays": "docs/recordings.md of this project; MATLAB level 5 files",
    "geotiff": "OGC GeoTIFF 1.1; GDAL data model: scale, offset, unit type, nodata, palette",
    "grid": "Esri ASCII raster format: cellsize, xllcenter, NODATA_value",
    "points": "columns of GPS loggers and elevation services; PCL's PCD; PLY; glTF 2.0 (y is up)",
    "las": "ASPRS LAS 1.4: classes, withheld points, WKT and GeoKeys",
    "raster": "pictures and arrays state neither the size of cells nor heights",
    "urdf": "urdfdom: limits in radians, masses in kilograms; ROS REP 103 and 105",
    "mjcf": "MuJoCo XML reference: compiler angle, autolimits, inertia",
    "sdf": "sdformat.org/spec: frames of links and joints",
    "calibration": "OpenCV stereoCalibrate (T in the unit of the board); Middlebury calib.txt (mm)",
}
"""What defines a statement, by the kind of its file."""


@dataclass(frozen=True)
class Case:
    """A file, how it is read, and what is correct."""

    kind: str
    """Kind of file, a key of ``SOURCES``."""
    statement: str
    """Statement that this file makes otherwise than its neighbour."""
    write: Callable[[Path], Path]
    """Writes the file into a folder."""
    read: Read
    answer: Values | str
    """Correct values, or a pattern of the question or the rejection."""
    options: dict[str, Any] = field(default_factory=dict)
    """Answers of the user."""

    @property
    def name(self) -> str:
        """Kind and statement."""
        return f"{self.kind}: {self.statement}"


@dataclass(frozen=True)
class Judgement:
    """Verdict on a case: right, asked, misleading or silent."""

    verdict: str
    states_all: bool
    """Whether it was read without a question, and no fact was inferred."""
    words: str = ""


def judge(case: Case, folder: Path) -> Judgement:
    """Write the file and its correct answer, then read it and compare."""
    folder.mkdir(parents=True, exist_ok=True)
    file = case.write(folder)
    answer = folder / "answer.json"
    answer.write_text(
        json.dumps(case.answer if isinstance(case.answer, str) else dict(case.answer))
    )
    try:
        values, facts = case.read(file, case.options)
    except InputError as error:
        if isinstance(case.answer, str) and re.search(case.answer, str(error), re.DOTALL):
            return Judgement("asked", False, str(error))
        return Judgement("misleading", False, str(error))
    correct = json.loads(answer.read_text())
    if isinstance(correct, str):
        return Judgement("silent", False, f"read as {dict(values)}, expected {correct}")
    wrong = {
        name: (values[name], value)
        for name, value in correct.items()
        if not np.isclose(values[name], value, rtol=TOLERANCE, atol=TOLERANCE, equal_nan=True)
    }
    if wrong:
        return Judgement("silent", False, f"wrong, correct: {wrong}")
    sources = {fact.source for fact in facts.values()}
    return Judgement("right", sources == {"file"} and not case.options)
