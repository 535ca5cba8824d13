"""Every reader states quantity, unit, order and time base of its file, each with a source."""

from pathlib import Path
from typing import Final, get_args

import pytest

pytest.importorskip("rasterio", reason="the extra maps is not installed")
pytest.importorskip("rosbags", reason="the extra ros is not installed")
pytest.importorskip("ezc3d", reason="the extra c3d is not installed")

from snakewalk.controller.console.plugins import names
from snakewalk.controller.mapping.elevation_file import ENDINGS
from snakewalk.controller.track.readers.formats import Format
from tests.foreign.every import every_case

CASES: Final = [case for case in every_case() if not isinstance(case.answer, str)]
MOVING: Final = {"joints", "lerobot", "midlines", "wcon", "tierpsy", "tracker", "qtm", "vicon",
                 "trc", "motive", "c3d", "bvh", "arrays"}  # fmt: skip
"""Kinds of files that have a time."""
JOINT_READERS: Final = {"csv": "joints", "ros2": "joints", "lerobot": "lerobot"}
FORMATS: Final = {"zip": "arrays", "npy": "a shipped layout of joint angles, read as bodies",
                  "hdf5": "tierpsy", "mat": "arrays", "json": "wcon", "csv": "midlines",
                  "qtm": "qtm", "c3d": "c3d", "trc": "trc", "bvh": "bvh"}  # fmt: skip
ELEVATIONS: Final = {".tif": "geotiff", ".tiff": "geotiff", ".asc": "grid", ".las": "las",
                     ".laz": "las", ".png": "raster", ".csv": "raster", ".npz": "raster",
                     ".pcd": "points", ".ply": "points", ".xyz": "points", ".obj": "points",
                     ".stl": "points", ".glb": "points"}  # fmt: skip


def test_each_registered_reader_has_generated_files() -> None:
    assert set(names("joints")) == set(JOINT_READERS)
    assert set(get_args(Format)) - {"empty", "binary"} == set(FORMATS)
    assert set(ENDINGS) == set(ELEVATIONS)


KINDS = sorted({case.kind for case in CASES})


@pytest.mark.parametrize("kind", KINDS)
def test_a_reader_states_all_facts_with_their_sources(kind: str, tmp_path: Path) -> None:
    case = next((c for c in CASES if c.kind == kind and not c.options), None)
    case = case or next(c for c in CASES if c.kind == kind)
    _, facts = case.read(case.write(tmp_path), case.options)
    wanted = {"quantity", "unit", "order"} | ({"time"} if kind in MOVING else set())
    assert wanted <= set(facts)
    for fact in facts.values():
        assert fact.source in ("file", "user", "inferred")
        assert fact.value
        assert fact.basis


@pytest.mark.parametrize(
    ("kind", "option", "name"),
    [
        ("midlines", "time_unit", "time"), ("midlines", "rate", "time"),
        ("tracker", "rate", "time"), ("motive", "plane", "plane"), ("qtm", "keypoints", "order"),
        ("points", "unit", "unit"), ("points", "up", "order"), ("geotiff", "unit", "unit"),
        ("urdf", "mass_scale", "unit"), ("urdf", "reverse", "order"),
        ("lerobot", "unit", "unit"), ("calibration", "unit", "unit"),
    ],
)  # fmt: skip
def test_an_option_is_the_source_of_its_fact(
    kind: str, option: str, name: str, tmp_path: Path
) -> None:
    case = next(c for c in CASES if c.kind == kind and option in c.options)
    _, facts = case.read(case.write(tmp_path), case.options)
    assert facts[name].source == "user"
