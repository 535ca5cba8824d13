"""A damaged file is read, or rejected with a line; it takes neither memory nor time."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("resource", reason="this system has no limits of memory")
pytest.importorskip("rasterio", reason="the extra maps is not installed")
pytest.importorskip("rosbags", reason="the extra ros is not installed")
pytest.importorskip("ezc3d", reason="the extra c3d is not installed")

from tests.foreign.fuzz.damage import damage
from tests.foreign.fuzz.limited import Ended, run
from tests.foreign.fuzz.targets import CHOSEN, READS, Target, others, readable

TARGETS = {name: readable()[name] for name in CHOSEN} | {each.name: each for each in others()}


def fuzzed(target: Target, folder: Path, seeds: range) -> Iterator[tuple[int, Ended]]:
    """Read a file, then damaged copies of it within multiples of what the clean one needed."""
    clean_folder = folder / "clean"
    clean_folder.mkdir()
    file = target.write(clean_folder)
    clean = run(lambda: target.read(file, target.options), folder)
    assert clean.outcome == "read", clean.words
    for seed in seeds:
        copy_folder = folder / str(seed)
        copy_folder.mkdir()
        copy = damage(file, copy_folder, target.name, seed)
        yield seed, run(lambda copy=copy: target.read(copy, target.options), folder, clean.cost)


def check(target: Target, folder: Path, seeds: range) -> Counter[str]:
    ended = dict(fuzzed(target, folder, seeds))
    faults = {seed: each.words for seed, each in ended.items() if each.outcome == "fault"}
    words = "\n".join(f"{target.name}, seed {seed}: {said}" for seed, said in faults.items())
    assert not faults, words
    return Counter(each.outcome for each in ended.values())


BY_DAY = [name for name in TARGETS if not name.startswith(("las", "laz", "c3d"))]
"""Without the files that another process reads, which need a minute."""


def test_every_reader_has_a_file() -> None:
    assert {target.read for target in TARGETS.values()} >= set(READS.values())
    assert {name.partition(":")[0] for name in CHOSEN} == set(READS)


@pytest.mark.fast_cases(14)
@pytest.mark.parametrize("name", BY_DAY)
def test_two_damaged_files_are_read_or_rejected(name: str, tmp_path: Path) -> None:
    check(TARGETS[name], tmp_path, range(2))


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_DAY)
def test_more_damaged_files_are_read_or_rejected(name: str, tmp_path: Path) -> None:
    check(TARGETS[name], tmp_path, range(2, 14))


@pytest.mark.nightly("200 damaged files of each reader: 5 min")
@pytest.mark.parametrize("name", TARGETS)
def test_many_damaged_files_are_read_or_rejected(name: str, tmp_path: Path) -> None:
    seeds = range(14, 214 if name in BY_DAY else 54)
    assert check(TARGETS[name], tmp_path, seeds)["rejected"] > 0


@pytest.mark.nightly("3 damaged files of each of the 440 generated files: 2 min")
@pytest.mark.parametrize("name", readable())
def test_damaged_generated_files_are_read_or_rejected(name: str, tmp_path: Path) -> None:
    check(readable()[name], tmp_path, range(3))
