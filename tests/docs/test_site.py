"""The site holds every page, and the reference every name; ``make docs`` builds it."""

import re
from pathlib import Path

import snakewalk

DOCS = Path(__file__).resolve().parents[2] / "docs"
TREE = re.compile(r"```\{toctree\}\n(.*?)```", re.DOTALL)


def held(page: Path) -> set[Path]:
    """Pages that the tables of contents of ``page`` name, and all that those name."""
    found: set[Path] = set()
    for tree in TREE.findall(page.read_text(encoding="utf-8")):
        options, _, names = tree.partition("\n\n")
        for name in names.split():
            named = page.parent.glob(f"{name}.md") if ":glob:" in options else None
            notebook = page.parent / f"{name}.ipynb"
            if notebook.is_file():
                found.add(notebook)
                continue
            for child in named or [page.parent / f"{name}.md"]:
                found |= {child} | (held(child) if child.is_file() else set())
    return found


def test_the_tables_of_contents_hold_every_page_and_no_other() -> None:
    pages = {*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")} - {DOCS / "index.md"}
    assert held(DOCS / "index.md") == {page for page in pages if page.parent.name != "decisions"}
    assert len(pages) <= MOST_PAGES + len(list((DOCS / "decisions").glob("*.md")))


def test_no_page_stands_in_two_places() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    names = [name for tree in TREE.findall(index) for name in tree.partition("\n\n")[2].split()]
    assert len(names) == len(set(names))


def test_another_page_links_each_page() -> None:
    pages = [page for page in DOCS.rglob("*.md") if page.parent.name != "decisions"]
    linked = {
        (page.parent / target).resolve()
        for page in pages
        for target in re.findall(r"\]\(([^)#\s]+\.md)", page.read_text(encoding="utf-8"))
        if (page.parent / target).resolve() != page
    }
    alone = [page.relative_to(DOCS).as_posix() for page in pages if page.resolve() not in linked]
    assert alone == ["index.md"]


def test_the_guides_begin_with_the_use_and_end_with_the_extension_of_the_program() -> None:
    guides = re.findall(r"^how-to/([\w-]+)$", (DOCS / "index.md").read_text("utf-8"), re.M)
    extends = [name.startswith("add-a") or name == "test-a-change" for name in guides]
    assert extends == sorted(extends)


def words(page: Path) -> int:
    """Number of words of a page: strings between blanks, without the bars and rules of tables."""
    text = page.read_text(encoding="utf-8").replace("|", " ")
    return sum(bool(re.search(r"\w", word)) for word in text.split())


def test_the_site_stays_short() -> None:
    pages = [page for page in DOCS.rglob("*.md") if page.parent.name != "decisions"]
    counts = {page.relative_to(DOCS).as_posix(): words(page) for page in pages}
    longest = sorted(counts, key=counts.__getitem__)[-5:]
    assert sum(counts.values()) <= MOST_WORDS, f"the longest pages are {', '.join(longest)}"


GENERATED = {"configuration.md", "api.md"}
LARGEST_PAGE = 250
"""Lines of a page above its measured figures."""
MOST_PAGES = 140
MOST_WORDS = 110_000
"""Words of the site with tables and commands, without decisions; the limit only falls."""


def guide(page: Path) -> str:
    """Return a page without its measured figures, which are its last section."""
    return page.read_text(encoding="utf-8").partition("\n## Measured\n")[0]


def test_no_page_written_by_hand_is_long() -> None:
    lines = {
        page.relative_to(DOCS).as_posix(): len(guide(page).splitlines())
        for page in DOCS.rglob("*.md")
        if page.name not in GENERATED
    }
    assert {name: count for name, count in lines.items() if count > LARGEST_PAGE} == {}


def test_the_reference_has_every_public_name() -> None:
    text = (DOCS / "api.md").read_text(encoding="utf-8")
    named = re.findall(r"^\.\. (?:autoclass|autofunction|data):: (\w+)", text, re.MULTILINE)
    assert sorted(named) == sorted(snakewalk.__all__)


def test_the_readme_is_a_screen_and_leads_to_pages_that_exist() -> None:
    readme = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    assert len(readme.splitlines()) <= 60
    assert set(re.findall(r"\]\((docs/start/\w+\.md)\)", readme)) == {
        f"docs/start/{page.name}" for page in (DOCS / "start").glob("*.md")
    }
