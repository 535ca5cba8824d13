"""Functions from a command to the loop of its run, and the files that are executed before it."""

import os
import sys
import tempfile
from contextlib import chdir, redirect_stdout, suppress
from inspect import CO_OPTIMIZED
from io import StringIO
from pathlib import Path
from types import FrameType
from typing import Any, Final

from benchmarks.rows import Row

TITLE = "path of a run: from the function of `snakewalk run` to `Drive.run`"
MOST_FUNCTIONS: Final = 6
MOST_FILES: Final = 30
PACKAGES: Final = ("cli/", "console/", "run/")
"""Packages of the controller that join a command with drivers and simulator."""
RUN: Final = """
name = "short"
robot = "yaw16"
world = "flat"
motion = "serpenoid"
waypoints_m = [[0.5, 0.0]]
waypoint_radius_m = 0.3
time_limit_s = 0.1
"""
_ROOT: Final = Path(__file__).parents[1] / "controller"


class PathToLoop:
    """The call stack at the first call of ``Drive.run``, and the files executed before it."""

    def __init__(self) -> None:
        self.functions: list[str] = []
        """``FILE:FUNCTION`` from the command's function to ``Drive.run``."""
        self.files: list[str] = []
        """Files of ``PACKAGES`` of which a function was executed."""
        self._codes: set[str] = set()

    def profile(self, frame: FrameType, event: str, argument: Any) -> None:
        """Follow a call, for ``sys.setprofile``."""
        code = frame.f_code
        if event != "call" or not code.co_flags & CO_OPTIMIZED:  # body of a module or a class
            return
        self._codes.add(code.co_filename)
        if code.co_qualname != "Drive.run":
            return
        sys.setprofile(None)
        at: FrameType | None = frame
        while at is not None and "/cli/" not in at.f_code.co_filename:
            self.functions.insert(0, f"{_short(at.f_code.co_filename)}:{at.f_code.co_qualname}")
            at = at.f_back
        files = {_short(name) for name in self._codes}
        self.files = sorted(name for name in files if name.startswith(PACKAGES))


def _short(file: str) -> str:
    path = Path(os.path.realpath(file))
    return str(path.relative_to(_ROOT)) if path.is_relative_to(_ROOT) else path.name


def path_to_loop() -> PathToLoop:
    """Run ``snakewalk run`` and return its path to the loop."""
    from snakewalk.controller.cli.main import main  # noqa: PLC0415  as in a program

    found = PathToLoop()
    before = sys.argv
    with tempfile.TemporaryDirectory() as folder, chdir(folder), redirect_stdout(StringIO()):
        Path("short.toml").write_text(RUN, encoding="utf-8")
        sys.argv = ["snakewalk", "run", "short.toml", "--no-film", "--json", "--quiet"]
        sys.setprofile(found.profile)
        try:
            with suppress(SystemExit):
                main()
        finally:
            sys.setprofile(None)
            sys.argv = before
    return found


def run() -> list[Row]:
    """Return both counts, and a row for each function and file."""
    found = path_to_loop()
    functions, files = len(found.functions), len(found.files)
    return [
        Row("functions", functions, "", "", functions, MOST_FUNCTIONS),
        *(Row(f"  {name}", number, "") for number, name in enumerate(found.functions, 1)),
        Row(f"files of {' '.join(PACKAGES)}", files, "", "", files, MOST_FILES),
        *(Row(f"  {name}", number, "") for number, name in enumerate(found.files, 1)),
    ]
