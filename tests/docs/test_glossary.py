"""The glossary explains each term once."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")


def test_no_term_stands_twice() -> None:
    terms = re.findall(r"^\| ([^|]+?) \| ", PAGE, re.MULTILINE)
    terms = [term for term in terms if term not in {"word", "---"}]
    assert len(terms) == len(set(terms))
