"""Every file name is made of words of the glossary."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
TOPS = ("config", "drivers", "sim", "controller")


def rows() -> dict[str, str]:
    """Meaning by term, as the page writes them."""
    return dict(re.findall(r"^\| ([^|]+?) \| ([^|]+?) \|$", PAGE, re.MULTILINE))


def normal(term: str) -> str:
    """``Pending replies``, ``pending_replies`` and ``pending reply`` as one spelling."""
    singular = [
        re.sub(r"(?<=[a-z]{2})ies$", "y", word)
        if word.endswith("ies") and word != "series"
        else re.sub(r"(?<=[^s])s$", "", word)
        for word in re.split(r"[ _\-/]+", term.strip().lower())
    ]
    return " ".join(singular)


def known() -> set[str]:
    """Terms of the page; those in parentheses and behind commas count as well."""
    terms: set[str] = set()
    for term, meaning in rows().items():
        terms |= {normal(part) for part in term.split(",")}
        for aside in re.findall(r"\(([^)]*)\)", meaning):
            terms |= {normal(part.strip(" `")) for part in aside.split(",")}
    return terms


def test_the_words_of_every_file_name_are_on_the_page() -> None:
    terms = known()
    stems = {file.stem for top in TOPS for file in (ROOT / top).rglob("*.py")} - {"__init__"}
    missing = {
        stem
        for stem in stems
        if normal(stem) not in terms and not all(normal(word) in terms for word in stem.split("_"))
    }
    assert missing == set()


def test_no_term_stands_twice() -> None:
    terms = re.findall(r"^\| ([^|]+?) \| ", PAGE, re.MULTILINE)
    terms = [term for term in terms if term not in {"word", "---"}]
    assert len(terms) == len(set(terms))
