"""Every reader of other programs' files keeps one contract: facts, questions and stored answers.

``config.reading`` decides whether a value is accepted, converted or asked for, and stores answers.
``config.file_units`` has all units. The tests fail if a module reads files, or converts units,
without being listed here with its entry or its reason.
"""

import ast
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import pytest

pytest.importorskip("rasterio", reason="the extra maps is not installed")
pytest.importorskip("rosbags", reason="the extra ros is not installed")

from snakewalk.config.answers import Answers
from snakewalk.config.playback import JointRequest
from snakewalk.controller.capture.film.film_options import FootageChoice
from snakewalk.controller.exchange.robot_import.robot_choice import RobotChoice
from snakewalk.controller.exchange.robot_import.robot_import import import_robot
from snakewalk.controller.mapping.elevation_choice import CalibrationChoice, ElevationChoice
from snakewalk.controller.mapping.elevation_file import MapOptions, read_elevation
from snakewalk.controller.mapping.stereo_camera import read_calibration
from snakewalk.controller.run.kinds.playback_run import foreign_joints
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import load_file, load_keypoints
from tests.architecture.tokens import sizes
from tests.controller.mapping.test_las_file import write as write_las
from tests.foreign.motions import ROBOT, bags, table
from tests.foreign.robots import NAMES, calibration
from tests.foreign.tracks import dlc_csv, files, markers, midlines, trc
from tests.helpers.command import snakewalk
from tests.helpers.foreign_files import massless_urdf, points

ROOT: Final = Path(__file__).resolve().parents[2]
READING: Final = frozenset(
    {
        *("read_bytes", "read_head", "read_text", "read_rows", "read_lines", "read_arrays"),
        *("read_json_object", "read_storage", "open_footage", "read_numbers"),
        *("VideoCapture", "FileStorage", "loadmat", "AnyReader", "read_table", "c3d", "imread"),
    }
)
"""Functions that read a file."""
LIBRARIES: Final = frozenset({"rasterio", "laspy", "ezc3d", "h5py", "rosbags", "trimesh"})
OWN: Final = "a format of this project"
ENTRIES: Final = {
    "controller/capture/commands/capture.py": "films",
    "controller/capture/film/keypoint_lines.py": "keypoints",
    "controller/exchange/robot_import/robot_import.py": "robot models",
    "controller/mapping/elevation_file.py": "elevations, points, laser scans",
    "controller/mapping/stereo_camera.py": "calibrations of two cameras",
    "controller/run/kinds/playback_run.py": "joint angles",
    "controller/track/readers/load.py": "tracks, keypoints, markers",
}
"""Modules that read with stored answers, and what."""
PARTS: Final = {
    **dict.fromkeys(("controller/capture/opened_film.py", "controller/images/video.py"), "films"),
    **{
        f"controller/exchange/joint_motions/{name}.py": "joint angles"
        for name in ("joint_table", "lerobot", "ros_joints")
    },
    "controller/exchange/robot_import/model_source.py": "robot models",
    **{
        f"controller/mapping/{name}.py": "elevations"
        for name in ("geo_raster", "las_file", "length_units", "number_table", "point_cloud",
                     "raster_file")
    },
    "controller/images/mesh_files.py": "elevations, and bodies of animals",
    **{
        f"controller/track/readers/{name}.py": "tracks"
        for name in ("arrays", "bvh", "c3d_file", "hdf5", "marker_tables", "markers", "mat_file",
                     "tables")
    },
}  # fmt: skip
"""Modules that only an entry calls, and what they read."""
OTHERS: Final = {
    **dict.fromkeys(
        (
            "config/ground.py", "config/heightfield.py", "config/loader.py",
            "config/strict_toml.py", "drivers/chain/fingerprint_file.py", "sim/sniff/trace.py",
            "controller/animals/fish/fish_synthesis.py", "controller/animals/fish/postures.py",
            "controller/animals/mesh/body_model.py", "controller/animals/mesh/body_motion.py",
            "controller/bench/eeprom_backup.py",
            "controller/bench/guided_setup.py", "controller/bench/loop_compiler.py",
            "controller/capture/capture.py", "controller/capture/corrections.py",
            "controller/capture/part_folder.py", "controller/capture/review.py",
            "controller/capture/verification/remedies.py",
            "controller/console/command.py", "controller/console/interrupted_progress.py",
            "controller/console/table.py",
            "controller/learning/policy_trials.py",
            "controller/rehearsal/commands/rehearse.py", "controller/rehearsal/commands/tasks.py",
            "controller/rehearsal/result_lines.py", "controller/repertoire/repertoire.py",
            "controller/repertoire/repertoire_planning.py",
            "controller/repertoire/schedule_run.py", "controller/report/page.py",
            "controller/studies/commands/sweep.py",
            "controller/studies/identification/pendulum_log.py",
            "controller/studies/identification/servo_constants.py",
            "controller/track/recorded_joints.py", "controller/view/gate.py",
            "controller/view/stop_element.py",
        ),
        OWN,
    ),
    "config/archive.py": "bounds each read",
    "controller/images/storage_file.py": "matrices of a calibration, for its readers",
    "controller/images/calibration_storage.py": "lists of a calibration in JSON, for its readers",
    "controller/mapping/mosaic/place_mesh.py": "writes a mesh",
    "config/text_table.py": "cells of a table, for its readers",
    "controller/animals/fish/silhouettes.py": "silhouettes in px; the rate is an option",
    "controller/animals/plots/fish.py": "pictures to draw on",
    "controller/animals/synthesis/tongue.py": "columns time_s, length_m or height",
    "controller/cameras/commands/lens.py": "pictures of a board, whose square is an option",
    "controller/cameras/device_camera.py": "a device",
    "controller/cameras/lens.py": "a lens has pixels and pure numbers",
    "controller/exchange/ros_bag.py": "writes bags",
    "controller/images/colour_picture.py": "colours",
    "controller/run/commands/gait_fit.py": "columns x_m, y_m, z_m",
    "controller/view/model_page.py": "draws meshes",
    "controller/view/scene.py": "draws meshes",
}  # fmt: skip
"""Modules without a question to the user, each with the reason."""


SHOWN: Final = {
    "controller/animals/commands/stride.py": "animal stride",
    "controller/animals/fish/fish_matching.py": "animal fish match",
    "controller/capture/capturing.py": "animal capture",
    "controller/capture/recording.py": "animal track",
    "controller/exchange/commands/robot_import.py": "robot import",
    "controller/mapping/commands/elevation.py": "world from",
    "controller/mapping/commands/stereo.py": "world stereo",
    "controller/mapping/commands/walkthrough.py": "world walkthrough",
    "controller/run/commands/play.py": "play",
    "controller/track/analysis.py": "animal analyse",
}
"""Modules that list the facts about a file in the results of a command."""


def modules() -> Iterator[tuple[str, ast.Module]]:
    for path in sizes():
        yield str(path.relative_to(ROOT)), ast.parse(path.read_text(encoding="utf-8"))


def called(tree: ast.Module) -> set[str]:
    """Names of called functions, and of libraries that read files."""
    nodes = list(ast.walk(tree))
    calls = [node.func for node in nodes if isinstance(node, ast.Call)]
    imports = {
        a.name.partition(".")[0] for n in nodes if isinstance(n, ast.Import) for a in n.names
    }
    imports |= {
        (node.module or "").partition(".")[0] for node in nodes if isinstance(node, ast.ImportFrom)
    }
    names = {f.id if isinstance(f, ast.Name) else getattr(f, "attr", "") for f in calls}
    return names | (imports & LIBRARIES)


def is_registers(name: str, names: set[str]) -> bool:
    """Whether ``read_bytes`` of a bus is meant."""
    return name.startswith("drivers/bus/") and names & READING == {"read_bytes"}


@pytest.mark.costs("parses every file of the library")
def test_every_module_that_reads_files_is_an_entry_or_below_one() -> None:
    readers = {
        name
        for name, tree in modules()
        if (names := called(tree)) & (READING | LIBRARIES) and not is_registers(name, names)
    }
    listed = {*ENTRIES, *PARTS, *OTHERS}
    assert readers - listed == set(), "read through config.reading.answered, or list the reason"
    assert listed - readers == {"controller/capture/commands/capture.py",
                                "controller/capture/film/keypoint_lines.py",
                                "controller/exchange/robot_import/robot_import.py"}  # fmt: skip


@pytest.mark.costs("parses every file of the library")
def test_entries_alone_use_stored_answers_and_questions_have_one_form() -> None:
    users = {name for name, tree in modules() if called(tree) & {"answered", "with_stored"}}
    plain = {"config/reading.py", "controller/run/commands/play.py"}
    assert users - plain == set(ENTRIES)


@pytest.mark.costs("parses every file of the library")
def test_each_command_lists_the_facts_about_its_file() -> None:
    assert {name for name, tree in modules() if "texts" in called(tree)} == SHOWN.keys()


UNITS: Final = frozenset({"mm", "cm", "km", "ft", "us-ft", "deg", "ms", "us", "ns", "um"})


def factors(tree: ast.Module) -> list[int]:
    """Lines of tables of units with numbers."""
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Dict)
        and any(
            isinstance(key, ast.Constant) and key.value in UNITS and not is_text(value)
            for key, value in zip(node.keys, node.values, strict=True)
        )
    ]


def is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


@pytest.mark.costs("parses every file of the library")
def test_one_module_has_the_factors_of_units() -> None:
    found = {name for name, tree in modules() if factors(tree)}
    assert found == {"config/file_units.py"}
    assert factors(ast.parse('x = {"mm": 1e-3, "m": 1.0}')) == [1]
    assert factors(ast.parse('x = {"mm": "metres", "s": f"{a}"}')) == []


@dataclass(frozen=True)
class Reader:
    """A reader: its answers, a file that leaves a question open, and how it is read."""

    choice: type[Any]
    write: Callable[[Path], Path]
    read: Callable[[Path], Any]
    answer: str
    """Line of ``FILE.reading.toml``."""
    fact: str
    """Fact that the answer states."""


def film(folder: Path) -> Path:
    """Write a film of a worm without a scale."""
    frames = folder / "film"
    frames.mkdir()
    for k in range(12):
        picture = np.full((120, 200), 230, np.uint8)
        x = np.linspace(40, 150, 60)
        y = 60 + 8 * np.sin(x / 15.0 - 0.5 * k)
        for size, (a, b) in zip(np.linspace(7, 2, 60), zip(x, y, strict=True), strict=True):
            cv2.circle(picture, (round(a + 2 * k), round(b)), round(size), 40, -1)
        cv2.imwrite(str(frames / f"{k:03}.png"), picture)
    return frames


def read_film(file: Path) -> Any:
    """Facts and notes of the command."""
    out = file.with_name("track.npz")
    shown = snakewalk("animal", "capture", str(file), "-o", str(out), "--force", "--json")
    assert shown.returncode == 1, "a film of 12 frames has no good frame"
    return json.loads(shown.stdout)


def facts_of(result: Any) -> dict[str, str]:
    facts = result["facts"] if isinstance(result, dict) else result.facts
    return {name: str(fact) for name, fact in facts.items()}


def las(folder: Path) -> Path:
    """Write a laser scan without a coordinate system."""
    x, y = np.meshgrid(np.arange(30.0), np.arange(30.0))
    cloud = np.stack([x.ravel(), y.ravel(), 0.1 * x.ravel()], axis=1)
    return write_las(folder / "a.las", cloud)


def joints(file: Path) -> Any:
    motion = foreign_joints(str(file), ROBOT, JointRequest())
    assert motion is not None
    return motion


def elevation(file: Path) -> Any:
    return read_elevation(file, MapOptions())


def robot(file: Path) -> Any:
    return import_robot(file, "r", "XM430-W350")


MASSES: Final = 'reverse = true\nassume = {"*.mass_kg" = "0.2"}'
TABLE: Final = table("", factor=57.3)
BOARD: Final = calibration("yml", NAMES[0], 1e3)
READERS: Final = {
    "joint tables": Reader(JointRequest, TABLE, joints, 'unit = "deg"', "unit"),
    "tracks": Reader(Choice, midlines(second=1e3), load_file, 'time_unit = "ms"', "time"),
    "keypoints": Reader(Choice, files("a.csv", dlc_csv), load_keypoints, "rate = 25", "time"),
    "markers": Reader(Choice, markers("t.trc", trc), load_file, "rate = 25", "time"),
    "points": Reader(
        ElevationChoice, lambda d: points(d / "p.xyz"), elevation, 'unit = "cm"', "unit"
    ),
    "laser scans": Reader(ElevationChoice, las, elevation, 'unit = "ft"', "unit"),
    "robot models": Reader(
        RobotChoice, lambda d: massless_urdf(d / "r.urdf"), robot, MASSES, "order"
    ),
    "calibrations": Reader(CalibrationChoice, BOARD, read_calibration, 'unit = "mm"', "unit"),
    "films": Reader(FootageChoice, film, read_film, "length_m = 0.1", "unit"),
}


def test_every_kind_of_answers_has_a_reader_here() -> None:
    def below(kind: type[Any]) -> set[str]:
        return {kind.__name__, *(c for k in kind.__subclasses__() for c in below(k))}

    containing = {"Answers", "PlaybackOptions", "AnimalChoice", "CaptureOptions"}
    here = {reader.choice.__name__ for reader in READERS.values()} - {"JointRequest"}
    assert below(Answers) - containing == here


@pytest.mark.parametrize("name", READERS)
def test_a_stored_answer_is_used_named_and_the_source_of_its_fact(
    name: str, tmp_path: Path
) -> None:
    reader = READERS[name]
    file = reader.write(tmp_path)
    file.with_name(f"{file.name}.reading.toml").write_text(reader.answer + "\n")
    result = reader.read(file)
    facts = facts_of(result)
    assert {"quantity", "unit", "order"} <= set(facts)
    assert "stated by you" in facts[reader.fact]
    notes = result["notes"] if isinstance(result, dict) else result.notes
    key = reader.answer.partition(" ")[0]
    assert notes[0].startswith(f"{file.name}.reading.toml: {key} = ")


def test_messages_of_a_bag_state_all_facts(tmp_path: Path) -> None:
    facts = joints(bags()(tmp_path)).facts
    assert set(facts) == {"quantity", "unit", "order", "time"}
    assert {fact.source for fact in facts.values()} == {"file"}
