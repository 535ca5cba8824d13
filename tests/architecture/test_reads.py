"""Files are read through ``config.archive``, which bounds them; ports are opened in one place."""

import ast
import resource
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from tests.architecture.tokens import sizes

pytestmark = pytest.mark.costs("reads every file of the library")

ROOT: Final = Path(__file__).resolve().parents[2]
OPENINGS: Final = {
    "config/archive.py": "bounds every read",
    "controller/bench/loop_compiler.py": "reads the package's own source",
    "controller/capture/review.py": "reads the package's own page",
    "controller/cli/main.py": "opens the null device",
    "controller/console/command.py": "reads the package's own source",
    "controller/mapping/geo_raster.py": "asks the system for a fault; GDAL reads blocks",
    "controller/report/page.py": "reads a film that the run has just written",
    "controller/runlog/reader.py": "reads a log row by row",
    "controller/runlog/truth.py": "reads a truth line by line, each up to a size",
    "controller/view/gate.py": "reads the package's own page",
    "controller/view/stop_element.py": "reads the package's own page",
    "drivers/port/network_port.py": "opens ports by the schemes of config.robot.ports",
    "drivers/port/port_holders.py": "reads the system's tables of processes",
    "drivers/port/serial_port.py": "reads the system's facts about an adapter",
    "drivers/safety/stop_output.py": "opens a port, not a file",
}
"""Files that open something themselves, each with the reason."""


def is_opening(call: ast.Call) -> bool:
    """Whether a call reads a file, or opens a port by a URL, without ``config.archive``."""
    if isinstance(call.func, ast.Name):
        return call.func.id == "open"
    if not isinstance(call.func, ast.Attribute):
        return False
    if call.func.attr in ("read_text", "read_bytes"):
        return not call.args
    if call.func.attr == "open":
        mode = next((a.value for a in call.args if isinstance(a, ast.Constant)), "r")
        return (not call.args or isinstance(call.args[0], ast.Constant)) and "r" in str(mode)
    return call.func.attr == "serial_for_url"


def openings(text: str) -> int:
    return sum(is_opening(n) for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Call))


def test_only_listed_files_open_files_or_ports() -> None:
    found = {
        str(path.relative_to(ROOT))
        for path in sizes()
        if openings(path.read_text(encoding="utf-8"))
    }
    assert found == set(OPENINGS), "read with config.archive, or list the file with a reason"


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("file.open('rb')", 1),
        ("file.open(newline='')", 1),
        ("open(name)", 1),
        ("file.read_text(encoding='utf-8')", 1),
        ("file.read_bytes()", 1),
        ("serial.serial_for_url(name)", 1),
        ("file.open('wb'); source.open(context); bus.read_bytes(1, register)", 0),
    ],
)
def test_openings_are_recognised(text: str, count: int) -> None:
    assert openings(text) == count


def limited() -> None:
    """Leave a process 2 GB of data; a file without end needed 5.6 GB."""
    resource.setrlimit(resource.RLIMIT_DATA, (2_000_000_000, 2_000_000_000))


FOLDERS: Final = {"zero.dataset": "meta/info.json", "zero.bag": "metadata.yaml"}
"""Readers of folders: the file in them that has no end."""
READERS: Final = (
    *(
        ("animal", "analyse", f"zero.{end}")
        for end in ("csv", "npz", "mp4", "bvh", "c3d", "hdf5", "h5", "mat", "trc", "wcon", "tsv")
    ),
    *(
        ("world", "from", f"zero.{end}", "-o", "w.toml")
        for end in (
            "csv",
            "pcd",
            "ply",
            "png",
            "xyz",
            "las",
            "laz",
            "tif",
            "asc",
            "obj",
            "glb",
            "stl",
        )
    ),
    *(("play", f"zero.{end}") for end in ("csv", "mcap", "db3", "dataset", "bag")),
    *(("robot", "import", f"zero.{end}", "-o", "r.toml") for end in ("urdf", "sdf", "xml")),
)


@pytest.mark.slow
@pytest.mark.slow_cases(2, "each starts the program: 2 s of CPU")
@pytest.mark.parametrize("words", READERS, ids=" ".join)
def test_a_file_without_end_is_rejected_within_limits(
    tmp_path: Path, words: tuple[str, ...]
) -> None:
    for word in words:
        if word.startswith("zero."):
            link = tmp_path / word / FOLDERS.get(word, "")
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to("/dev/zero")
    program = Path(sys.executable).with_name("snakewalk")
    done = subprocess.run(
        [program, *words],
        cwd=tmp_path,
        preexec_fn=limited,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("snakewalk: zero.")
