"""LAS and LAZ: the ground's points, with the units that the file states."""

import json
import resource
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import laspy
import numpy as np
import pytest
from laspy.vlrs.known import GeoKeyDirectoryVlr, WktCoordinateSystemVlr
from rasterio.crs import CRS
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.console import separate_reader
from snakewalk.controller.console.pool import process_pool
from snakewalk.controller.mapping import las_file
from snakewalk.controller.mapping.elevation_choice import ElevationChoice
from snakewalk.controller.mapping.elevation_file import FileMap, MapOptions, read_elevation
from snakewalk.controller.mapping.las_file import child

COUNT = 6000


def cloud(seed: int = 0) -> Any:
    """Points of a slope 40 by 30, with trees on every third and birds."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 40, COUNT), rng.uniform(0, 30, COUNT)
    kinds = np.where(np.arange(COUNT) % 3 == 0, 5, 2)
    kinds[::100] = 7
    z = 10.0 + 0.2 * x + np.where(kinds == 5, 8.0, 0.0) + np.where(kinds == 7, 300.0, 0.0)
    return np.stack([x, y, z], -1), kinds


def write(
    file: Path, points: Any, kinds: Any = None, *, wkt: str = "",
    keys: dict[int, int] | None = None, scale: float = 0.001,
    withheld: Any = None, form: int = 6,
) -> Path:  # fmt: skip
    header = laspy.LasHeader(point_format=form, version="1.4" if form > 5 else "1.2")
    header.scales = [scale, scale, 0.001]
    header.offsets = np.floor(points.min(axis=0))
    if wkt:
        header.vlrs.append(WktCoordinateSystemVlr(wkt))
    if keys is not None:
        record = GeoKeyDirectoryVlr()
        rows = [(1, 1, 0, len(keys)), *((key, 0, 1, value) for key, value in keys.items())]
        record.parse_record_data(np.array(rows, "<u2").tobytes())
        header.vlrs.append(record)
    held = laspy.LasData(header)
    held.x, held.y, held.z = points.T
    if kinds is not None:
        held.classification = kinds
    if withheld is not None:
        held.withheld = withheld
    held.write(file)
    return file


def read(file: Path, spacing_m: float = 1.0, **units: Any) -> FileMap:
    crop = units.pop("crop", None)
    return read_elevation(file, MapOptions(ElevationChoice(**units), crop, spacing_m=spacing_m))


def noted(found: FileMap, words: str) -> bool:
    return any(words in line for line in (*found.notes, *map(str, found.facts.values())))


UTM = CRS.from_epsg(32632).to_wkt()


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Read intact files here; the command and the broken files show the process of its own."""
    monkeypatch.setattr(las_file, "read_separately", lambda file, _, *given: child(file, *given))


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("ending", ["las", "laz"])
def test_the_points_of_the_ground_are_used_and_the_others_counted(
    tmp_path: Path, ending: str
) -> None:
    points, kinds = cloud()
    shifted = np.add(points, [500000.0, 4500000.0, 0.0])
    file = write(tmp_path / f"a.{ending}", shifted, kinds, wkt=UTM)
    found = read(file)
    assert found.relief_m == pytest.approx(8.0, abs=0.4)
    assert noted(found, "3960 points of 6000 are used: those of the ground")
    assert noted(found, "60 of class 7 (low noise)")
    assert noted(found, "1980 of class 5 (high vegetation)")
    everything = read(file, classes=(2, 5, 7), point="highest")
    assert everything.relief_m > 290.0


@pytest.mark.usefixtures("in_this_process")
def test_without_a_class_of_ground_all_but_noise_counts(tmp_path: Path) -> None:
    points, kinds = cloud()
    kinds = np.where(kinds == 2, 1, kinds)
    found = read(write(tmp_path / "a.las", points, kinds, wkt=UTM), point="lowest")
    assert noted(found, "5940 points of 6000 are used: no class is ground")
    assert noted(found, "left out: 60 of class 7 (low noise); --classes chooses")


@pytest.mark.usefixtures("in_this_process")
def test_withheld_points_are_left_out(tmp_path: Path) -> None:
    points, _ = cloud()
    held_back = np.zeros(COUNT, bool)
    held_back[:50] = True
    file = write(tmp_path / "a.las", points, np.full(COUNT, 2), wkt=UTM, withheld=held_back)
    assert noted(read(file, classes=(2,), point="lowest"), "50 withheld points are left out")


@pytest.mark.usefixtures("in_this_process")
def test_units_are_those_that_the_file_states(tmp_path: Path) -> None:
    points, _ = cloud()
    kinds = np.full(COUNT, 2)
    ground = points * [1, 1, 0] + [0, 0, 1] * (0.2 * points[:, :1])
    feet = CRS.from_epsg(2263).to_wkt()
    there = np.add(ground, [1e6, 2e5, 0.0])
    with pytest.raises(
        InputError, match=r"in us-ft, and it states no unit of heights; .*-unit us-ft"
    ):
        read(write(tmp_path / "a.las", there, kinds, wkt=feet))
    both = CRS.from_user_input("EPSG:2263+6360").to_wkt()
    found = read(write(tmp_path / "a.las", there, kinds, wkt=both))
    foot = 1200 / 3937
    assert found.size_m == pytest.approx((40 * foot, 30 * foot), rel=1e-2)
    assert found.relief_m == pytest.approx(8 * foot, rel=0.05)
    keyed = write(
        tmp_path / "b.las", np.add(ground, [5e5, 4e6, 0]), kinds,
        keys={1024: 1, 3072: 32632, 3076: 9001, 4099: 9002}, form=3,
    )  # fmt: skip
    found = read(keyed)
    assert found.size_m == pytest.approx((40, 30), rel=1e-2)
    assert found.relief_m == pytest.approx(8 * 0.3048, rel=0.05)
    assert noted(found, "ft (stated by its coordinate system)")
    known = write(
        tmp_path / "c.las",
        np.add(ground, [1e6, 2e5, 0]),
        kinds,
        keys={1024: 1, 3072: 2263},
        form=3,
    )
    assert read(known, height_unit="m").size_m == pytest.approx((40 * foot, 30 * foot), rel=1e-2)
    degrees = write(
        tmp_path / "d.las", np.add(ground * [1e-5, 1e-5, 1], [8, 45, 0]), kinds, scale=1e-7,
        wkt=CRS.from_epsg(4326).to_wkt(),
    )  # fmt: skip
    assert read(degrees).size_m == pytest.approx((40 * 0.7885, 30 * 1.1113), rel=1e-2)


@pytest.mark.usefixtures("in_this_process")
def test_a_file_without_a_system_is_asked_about(tmp_path: Path) -> None:
    points, kinds = cloud()
    file = write(tmp_path / "a.las", points, kinds)
    with pytest.raises(InputError, match=r"states no coordinate system, .*--unit m\) or feet "):
        read(file)
    assert read(file, unit="m").size_m == pytest.approx((40, 30), rel=1e-2)
    assert read(file, unit="ft").size_m == pytest.approx((40 * 0.3048, 30 * 0.3048), rel=1e-2)


@pytest.mark.usefixtures("in_this_process")
def test_web_mercator_points_have_true_lengths(tmp_path: Path) -> None:
    points, kinds = cloud()
    file = write(
        tmp_path / "a.las", np.add(points, [900000.0, 6446275.0, 0]), kinds,
        wkt=CRS.from_epsg(3857).to_wkt(),
    )  # fmt: skip
    found = read(file, spacing_m=0.7)
    assert found.size_m == pytest.approx((40 * 0.644, 30 * 0.6423), rel=1e-2)
    assert noted(found, "the projection has no true lengths")


@pytest.mark.usefixtures("in_this_process")
def test_a_crop_is_cut_while_the_file_is_read(tmp_path: Path) -> None:
    points, kinds = cloud()
    file = write(tmp_path / "a.laz", np.add(points, [5e5, 4e6, 0]), kinds, wkt=UTM)
    found = read(file, crop=(10.0, 5.0, 20.0, 25.0))
    assert found.size_m == pytest.approx((10, 20), abs=0.3)
    with pytest.raises(InputError, match=r"holds no point|nothing is within"):
        read(file, crop=(100.0, 100.0, 110.0, 110.0))


@pytest.mark.usefixtures("in_this_process")
def test_too_many_points_are_asked_to_be_cropped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(las_file, "MOST_POINTS", 1000)
    points, kinds = cloud()
    file = write(tmp_path / "a.laz", points, kinds, wkt=UTM)
    with pytest.raises(InputError, match="over 1000 points are left of 6000: --crop a part"):
        read(file)


def test_the_command_reads_it_and_notes_what_it_left_out(tmp_path: Path) -> None:
    points, kinds = cloud()
    file, out = write(tmp_path / "a.laz", points, kinds, wkt=UTM), tmp_path / "w.toml"
    words = ["world", "from", str(file), "-o", str(out), "--scale", "0.1", "--json"]
    ran = CliRunner().invoke(app, words)
    assert ran.exit_code == 0, ran.output
    assert json.loads(ran.stdout)["notes"][0].startswith("3960 points of 6000 are used")
    assert "left out: 1980 of class 5" in out.read_text()
    wrong = CliRunner().invoke(app, [*words, "--force", "--classes", "2;9"])
    assert "--classes 2;9: must be a whole number" in str(wrong.exception)


def limited_child(words: tuple[str, ...], memory_bytes: int) -> str:
    resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
    return separate_reader.child(*words)


@pytest.fixture
def one_process(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Read all files in one other process; the program starts one for each."""
    with ExitStack() as stack:
        pools: list[ProcessPoolExecutor] = []

        def run_limited(_: str, *words: str, most: tuple[int, int]) -> SimpleNamespace:
            if not pools:
                pools.append(stack.enter_context(process_pool(1)))
            try:
                said = pools[0].submit(limited_child, words, most[0]).result()
            except BrokenProcessPool:
                pools.clear()
            except MemoryError:
                pass
            else:
                return SimpleNamespace(stdout=said)
            return SimpleNamespace(stdout="")

        monkeypatch.setattr(separate_reader, "run_limited", run_limited)
        yield


@pytest.mark.slow
@pytest.mark.usefixtures("one_process")
def test_broken_files_end_with_a_line(tmp_path: Path) -> None:
    """They are read in another process with limits: damaged counts ask for any memory."""
    rng = np.random.default_rng(0)
    points, kinds = cloud()
    las, laz = (
        write(tmp_path / f"a.{ending}", points[:300], kinds[:300], wkt=UTM).read_bytes()
        for ending in ("las", "laz")
    )
    outcomes = {"read": 0, "rejected": 0}
    for number in range(40):
        raw = bytearray(laz if number % 2 else las)
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(raw) if rng.random() < 0.5 else 400))
            if rng.random() < 0.8:
                raw[at] = int(rng.integers(256))
            else:
                del raw[at : at + int(rng.integers(1, 300))]
        file = tmp_path / f"b.{'laz' if number % 2 else 'las'}"
        file.write_bytes(bytes(raw))
        try:
            read(file, spacing_m=5.0, unit="m")
            outcomes["read"] += 1
        except InputError:
            outcomes["rejected"] += 1
    assert min(outcomes.values()) > 3


def test_a_decoder_that_aborts_is_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points, kinds = cloud()
    file = write(tmp_path / "a.laz", points, kinds, wkt=UTM)
    monkeypatch.setattr(separate_reader, "_CHILD", "import os; os.abort()")
    with pytest.raises(
        InputError, match=r"a\.laz: is damaged: its decoder gave up, or needed over"
    ):
        read(file)
