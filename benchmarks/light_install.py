"""Sizes of the installs: of a test suite's fixture, without the compiler, and the base.

Files of the installed distributions, without byte code. The size of snakewalk is that of the
modules and files in the wheel's folders.
"""

from collections.abc import Sequence
from importlib.metadata import distribution, requires
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from benchmarks.rows import Row

TITLE = "Sizes of the installs"

FIXTURE = (
    *("numpy", "pydantic", "pydantic-core", "typing-extensions", "annotated-types"),
    *("typing-inspection", "dynamixel-sdk", "pyserial"),
)
COMPILER = ("numba", "llvmlite")
TESTS = ("pytest", "pluggy", "iniconfig", "packaging", "pygments")
FOLDERS = ("config", "drivers", "sim", "controller")
MEGABYTE = 1e6


def run() -> list[Row]:
    """Measure."""
    base = _needed("snakewalk") - {"snakewalk"}
    parts: dict[str, Sequence[str]] = {
        "fixture of a test suite, with pytest": (*FIXTURE, *TESTS),
        "base without the compiler": sorted(base.difference(COMPILER)),
        "base": sorted(base),
    }
    rows = []
    for title, names in parts.items():
        sizes = {name: _distribution_bytes(name) for name in names}
        sizes["snakewalk"] = _own_bytes()
        rows.append(Row(title, sum(sizes.values()) / MEGABYTE, "MB"))
        largest = sorted(sizes, key=lambda name: -sizes[name])[:4]
        rows += [Row(f"  {name}", sizes[name] / MEGABYTE, "MB") for name in largest]
    return rows


def _needed(name: str) -> set[str]:
    """Return a distribution and what it needs without extras, directly or not."""
    found, waiting = set[str](), [name]
    while waiting:
        found.add(name := waiting.pop())
        for line in requires(name) or ():
            requirement = Requirement(line)
            key = canonicalize_name(requirement.name)
            if key not in found and (
                not requirement.marker or requirement.marker.evaluate({"extra": ""})
            ):
                waiting.append(key)
    return found


def _distribution_bytes(name: str) -> int:
    found = distribution(name)
    paths = [Path(str(found.locate_file(file))) for file in found.files or []]
    return sum(path.stat().st_size for path in paths if path.is_file() and path.suffix != ".pyc")


def _own_bytes() -> int:
    root = Path(__file__).parents[1]
    files = (path for folder in FOLDERS for path in (root / folder).rglob("*"))
    return sum(
        path.stat().st_size for path in files if path.is_file() and "__pycache__" not in path.parts
    )
