"""The errata of the papers name modules and tests that exist."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8").partition("\n## Errata\n")[2]


def test_every_module_and_test_named_exists() -> None:
    named = re.findall(r"`([\w/]+\.py)`", PAGE)
    assert len(named) > 20
    assert [path for path in named if not (ROOT / path).is_file()] == []

    tests = set(re.findall(r"`(test_\w+)`", PAGE))
    sources = "\n".join(path.read_text() for path in (ROOT / "tests").rglob("test_*.py"))
    defined = set(re.findall(r"def (test_\w+)\(", sources))
    assert len(tests) > 15
    assert tests - defined == set()


def test_every_row_names_code_and_a_test() -> None:
    rows = []
    for block in re.findall(r"(?:^\|.*\n)+", PAGE, re.MULTILINE):
        header, _, *body = block.splitlines()
        if header.endswith("| test |"):
            rows += body
    assert len(rows) > 55
    assert [row for row in rows if not re.match(r" `test_\w+`", row.rsplit("|", 2)[1])] == []
    assert [row for row in rows if ".py`" not in row.rsplit("|", 3)[1]] == []


def test_no_row_of_a_table_is_torn() -> None:
    for block in re.findall(r"(?:^\|.*\n)+", PAGE, re.MULTILINE):
        assert len({line.count("|") for line in block.splitlines()}) == 1, block
