"""Accounts without a writable folder run, and use the loops that another account has stored."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from snakewalk.drivers.loop_cache import _Temporary

PROGRAM = """
import os
from snakewalk.drivers.compilation import observe_compilation
observe_compilation(lambda name: print("compiled"))
from snakewalk.drivers.compiling import compiled, compiled_when_called

if "READ_ONLY" in os.environ:
    from numba.core.caching import InTreeCacheLocator
    def refuse(self):
        raise PermissionError(13, "Permission denied")
    InTreeCacheLocator.ensure_cache_path = refuse

@compiled("float64(float64)")
def doubled(value):
    return 2.0 * value

def tripled(value):
    return 3.0 * value

later = compiled_when_called(tripled)
print(doubled(2.0), later(2.0), later.stats.cache_misses.total())
"""


def start(folder: Path, **environment: str) -> list[str]:
    """Output of a program that defines two loops; its home is a file, for root too."""
    environ = {key: text for key, text in os.environ.items() if not key.startswith("NUMBA")}
    environ |= {"HOME": os.devnull, "PYTHONPATH": str(folder), **environment}
    environ.pop("XDG_CACHE_HOME", None)
    done = subprocess.run(
        [sys.executable, "-c", "import loops"],
        env=environ, check=True, capture_output=True, text=True,
    )  # fmt: skip
    return [*done.stdout.splitlines(), *done.stderr.splitlines()]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "loops.py").write_text(PROGRAM)
    (tmp_path / "tmp").mkdir()
    return tmp_path


def test_the_folder_for_temporary_files_is_of_one_account(tmp_path: Path) -> None:
    """Whoever writes there chooses what numba executes."""
    locator = _Temporary(start, __file__)
    locator.folder = str(tmp_path / "loops")
    mask = os.umask(0)
    try:
        locator.ensure_cache_path()
    finally:
        os.umask(mask)
    assert (tmp_path / "loops").stat().st_mode & 0o777 == 0o700


@pytest.mark.slow
def test_loops_go_to_the_folder_for_temporary_files(folder: Path) -> None:
    (folder / "__pycache__").touch()
    temporary = folder / "tmp"
    compiled, values, *told = start(folder, TMPDIR=str(temporary))
    assert (compiled, values) == ("compiled", "4.0 6.0 1")
    (made,) = temporary.iterdir()
    assert made.stat().st_mode & 0o777 == 0o700
    assert told == [
        f"compiled loops are stored in {made}, because neither snakewalk's folder nor the cache in "
        "the home folder is writable"
    ]
    assert start(folder, TMPDIR=str(temporary)) == ["4.0 6.0 0"]


@pytest.mark.fast_cases(1)
@pytest.mark.costs("an interpreter that imports and compiles")
@pytest.mark.parametrize("case", ["a file", "others may write"])
def test_without_any_folder_loops_are_compiled_at_each_start(folder: Path, case: str) -> None:
    (folder / "__pycache__").touch()
    place = folder / "tmp" / f"snakewalk-{os.getuid()}-loops"
    if case == "a file":
        place.touch()
    else:
        place.mkdir()
        place.chmod(0o777)
    compiled, values, told = start(folder, TMPDIR=str(folder / "tmp"))
    assert (compiled, values) == ("compiled", "4.0 6.0 1")
    assert "each start compiles them again; name a writable folder by NUMBA_CACHE_DIR" in told


@pytest.mark.nightly("three starts of an interpreter: 4 s of CPU")
def test_stored_loops_serve_accounts_that_cannot_write_next_to_them(folder: Path) -> None:
    """Two accounts: with the folder for temporary files, and without any."""
    assert start(folder)[:2] == ["compiled", "4.0 6.0 1"]
    stored = {file.name for file in (folder / "__pycache__").glob("*.nb?")}
    assert len(stored) == 4
    for temporary in (folder / "tmp", folder / "loops.py"):
        lines = start(folder, READ_ONLY="1", TMPDIR=str(temporary))
        assert lines == ["4.0 6.0 0"]
    assert not list((folder / "tmp").rglob("*.nb?"))


def result(folder: Path) -> tuple[float, int]:
    """Value of ``loops.loop`` that is imported afresh, and how often it was not in the cache."""
    for name in ("loops", "parts", "inner", "numbers_of_it"):
        sys.modules.pop(name, None)
    for stale in (folder / "__pycache__").glob("*.pyc"):  # as old and as large as the next one
        stale.unlink()
    importlib.invalidate_caches()
    loop = importlib.import_module("loops").loop
    return loop(2.0), loop.stats.cache_misses.total()


@pytest.mark.costs("an interpreter that imports and compiles")
def test_a_loop_is_compiled_again_if_a_function_or_number_of_another_file_changes(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(folder))
    (folder / "loops.py").write_text(
        "from snakewalk.drivers.compiling import compiled\n"
        "from numbers_of_it import FACTOR\n"
        "from parts import part\n"
        '@compiled("float64(float64)")\n'
        "def loop(value):\n"
        "    return FACTOR * part(value)\n"
        "print(loop(2.0), loop.stats.cache_misses.total())\n"
    )
    part = "from snakewalk.drivers.compiling import compiled\nfrom inner import inner\n"
    part += '@compiled("float64(float64)")\ndef part(value):\n    return inner(value)\n'
    inner = "from numba import njit\n@njit\ndef inner(value):\n    return value + {}\n"
    (folder / "numbers_of_it.py").write_text("FACTOR = 2.0\n")
    (folder / "parts.py").write_text(part)
    (folder / "inner.py").write_text(inner.format("1.0"))
    assert start(folder) == ["6.0 1"]
    (folder / "inner.py").write_text(inner.format("10.0"))
    assert result(folder) == (24.0, 1)
    assert result(folder) == (24.0, 0)
    (folder / "numbers_of_it.py").write_text("FACTOR = 3.0\n")
    assert result(folder) == (36.0, 1)
    assert result(folder) == (36.0, 0)
