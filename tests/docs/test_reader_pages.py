"""Each row of a reader's table, and of the table of foreign files, has a test that exists."""

import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "docs" / "how-to" / "read-files.md"]
FOREIGN = ROOT / "docs" / "benchmarks" / "foreign-files.md"


@cache
def known_tests() -> frozenset[str]:
    """Names of all test functions."""
    return frozenset(
        name
        for file in (ROOT / "tests").rglob("test_*.py")
        for name in re.findall(r"^def (test_\w+)", file.read_text(encoding="utf-8"), re.MULTILINE)
    )


def rows(page: Path) -> list[list[str]]:
    """Cells of the rows of all tables that have a column ``test``."""
    found: list[list[str]] = []
    has_tests = False
    for line in page.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("| ").split(" | ")]
        if not line.startswith("|"):
            has_tests = False
        elif cells[-1] == "test":
            has_tests = True
        elif has_tests and not set(cells[0]) <= {"-", ":"}:
            found.append(cells)
    return found


@pytest.mark.parametrize("page", [*PAGES, FOREIGN], ids=lambda page: page.stem)
def test_each_row_names_a_test_that_exists(page: Path) -> None:
    table = rows(page)
    assert len(table) > 5
    named = [re.findall(r"`(test_\w+)`", cells[-1]) for cells in table]
    assert [cells[0] for cells, names in zip(table, named, strict=True) if not names] == []
    assert {name for names in named for name in names} - known_tests() == set()
