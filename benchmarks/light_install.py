"""Size of the light install: the packages that the fixture of a test suite needs.

Files of the installed distributions, without byte code. The size of snakewalk is that of the
modules and files in the wheel's folders.
"""

from importlib.metadata import distribution
from pathlib import Path

from benchmarks.rows import Row

TITLE = "Size of the light install"

PACKAGES = (
    *("numpy", "pydantic", "pydantic-core", "typing-extensions", "annotated-types"),
    *("typing-inspection", "dynamixel-sdk", "pyserial"),
)
TESTS = ("pytest", "pluggy", "iniconfig", "packaging", "pygments")
FOLDERS = ("config", "drivers", "sim", "controller")
MEGABYTE = 1e6


def run() -> list[Row]:
    """Measure."""
    sizes = {name: _distribution_bytes(name) for name in (*PACKAGES, *TESTS)}
    sizes["snakewalk"] = _own_bytes()
    largest = sorted(sizes, key=lambda name: -sizes[name])[:4]
    rows = [Row(name, sizes[name] / MEGABYTE, "MB") for name in largest]
    return [Row("all", sum(sizes.values()) / MEGABYTE, "MB"), *rows]


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
