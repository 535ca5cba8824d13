"""The steps that a page prints, and a copy of the library to which they are applied.

A block whose first line is ``# PATH`` is a file. A ``diff`` block whose first line is ``+++ PATH``
changes a file of the library: lines that begin with a space must be there, one after the other.
A ``console`` block contains commands.
"""

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HOW_TO = ROOT / "docs" / "how-to"


@dataclass(frozen=True)
class Page:
    """A page and what it tells the reader to do."""

    text: str
    files: dict[str, str]
    """Text of each file by its path."""
    changes: list[tuple[str, str, str]]
    """Path, lines before, lines after."""
    commands: list[str]

    @property
    def touched(self) -> set[str]:
        """Files of the library that the page adds or changes."""
        return {*self.files, *(path for path, _, _ in self.changes)}


def page(name: str) -> Page:
    """Read a page of ``docs/how-to``."""
    text = (HOW_TO / f"{name}.md").read_text(encoding="utf-8")
    files = {
        body.partition("\n")[0].removeprefix("# "): body
        for body in re.findall(r"^```(?:python|toml)\n(# \S+\.\w+\n.*?)^```", text, re.M | re.S)
    }
    commands = [
        line
        for block in re.findall(r"^```console\n(.*?)^```", text, re.M | re.S)
        for line in block.splitlines()
    ]
    diffs = re.findall(r"^```diff\n\+\+\+ (\S+)\n(.*?)^```", text, re.M | re.S)
    changes = [(path, _side(body, "-"), _side(body, "+")) for path, body in diffs]
    return Page(text, files, changes, commands)


def _side(body: str, sign: str) -> str:
    lines = [line or " " for line in body.splitlines()]
    return "".join(f"{line[1:]}\n" for line in lines if line[0] in {" ", sign})


class Library:
    """A copy of the library in a folder; links to what no page changes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.top = folder / "snakewalk"
        self.top.mkdir()
        for each in (ROOT / "snakewalk").iterdir():
            if each.name != "__pycache__":
                (self.top / each.name).symlink_to(each.resolve())

    def apply(self, steps: Page) -> None:
        """Write the files of a page, and make its changes."""
        for path, body in steps.files.items():
            self._own(path).write_text(body, encoding="utf-8")
        for path, before, after in steps.changes:
            file = self._own(path)
            text = file.read_text(encoding="utf-8")
            assert text.count(before) == 1, f"{path}: these lines occur not once:\n{before}"
            file.unlink()  # a link to the original
            file.write_text(text.replace(before, after), encoding="utf-8")

    def _own(self, path: str) -> Path:
        """Return the place of a file, in folders that are no links."""
        place = self.top
        for part in Path(path).parts[:-1]:
            place /= part
            if place.is_symlink():
                original = place.resolve()
                place.unlink()
                place.mkdir()
                for each in original.iterdir():
                    (place / each.name).symlink_to(each)
        return place / Path(path).name

    def run(self, program: str, folder: Path) -> str:
        """Run a Python program with this copy in a folder; return its output."""
        done = subprocess.run(
            [sys.executable, "-c", program],
            cwd=folder,
            env=os.environ
            | {"PYTHONPATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1", "COLUMNS": "200"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout
