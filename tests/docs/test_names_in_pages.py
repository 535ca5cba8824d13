"""Files, modules and classes that the pages name exist."""

import re
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("config", "drivers", "sim", "controller", "tests", "docs", "benchmarks", "examples")
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
HISTORY = {"CHANGELOG.md"}
"""Names what is gone."""

ANY = "|".join(FOLDERS)
PATH = re.compile(rf"(?<![\w/.-])(?:{ANY})/[\w/.-]*\w")
DOTTED = re.compile(rf"(?<![\w/.])(?:snakewalk\.)?(?:{ANY})(?:\.\w+)+")
CLASS = re.compile(r"\b[A-Z][a-z]+[A-Z]\w+\b")
STANDARD = {f"{name}.py" for name in sys.stdlib_module_names}
"""Modules of Python itself."""


def quoted(page: Path) -> str:
    """Everything in backticks, blocks of code included."""
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```.*?^```", text, re.MULTILINE | re.DOTALL)
    rest = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    return "\n".join([*blocks, *re.findall(r"`([^`]+)`", rest)])


def added(page: Path) -> set[str]:
    """Return the files that the page tells the reader to write: blocks that begin with a name."""
    text = page.read_text(encoding="utf-8")
    return set(re.findall(r"^```python\n# (\S+\.py)$", text, re.MULTILINE))


@cache
def modules() -> set[str]:
    """Return the names of all files of Python."""
    return {file.name for folder in FOLDERS for file in (ROOT / folder).rglob("*.py")}


@cache
def is_defined(dotted: str) -> bool:
    """Whether a dotted name is a module, a package, or a name that one of these holds."""
    parts = dotted.removeprefix("snakewalk.").split(".")
    for end in range(len(parts), 0, -1):
        place = ROOT.joinpath(*parts[:end])
        file = place.with_suffix(".py") if not place.is_dir() else place / "__init__.py"
        if file.is_file():
            source = file.read_text(encoding="utf-8")
            return all(re.search(rf"\b{name}\b", source) for name in parts[end:])
    return False


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_and_modules_exist(page: Path) -> None:
    if page.name in HISTORY:
        return
    text = quoted(page)
    wrong = {path for path in PATH.findall(text) if not (ROOT / path).exists()} - added(page)
    files = (".toml", ".md", ".csv", ".npz", ".py")
    wrong |= set(re.findall(r"(?<![\w/.-])\w+\.py\b", text)) - modules() - STANDARD - added(page)
    wrong |= {
        name for name in DOTTED.findall(text) if not name.endswith(files) and not is_defined(name)
    }
    assert wrong == set()


def test_classes_exist() -> None:
    sources = "\n".join(
        file.read_text(encoding="utf-8")
        for folder in (*FOLDERS, "snakewalk")
        for file in (ROOT / folder).rglob("*.py")
        if "docs/test_names" not in str(file)
    )
    names = {
        name for page in PAGES if page.name not in HISTORY for name in CLASS.findall(quoted(page))
    }
    pages = (ROOT / "controller/report/templates").iterdir()
    sources += "".join(file.read_text(encoding="utf-8") for file in pages)
    defined = set(re.findall(r"\w+", sources))
    defined |= {
        name for page in PAGES for name in re.findall(r"^class (\w+)", quoted(page), re.MULTILINE)
    }
    assert names - defined == set()
