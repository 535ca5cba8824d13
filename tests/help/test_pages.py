"""The help of every command equals its stored page; ``python -m tests.help`` writes them."""

import pytest

from tests.help.shown import FOLDER, Page, shown_pages


@pytest.fixture(scope="module")
def pages() -> list[Page]:
    """Help of every command, shown once."""
    return [*shown_pages()]


def test_the_help_of_every_command_is_stored(pages: list[Page]) -> None:
    stored = {file.name: file.read_text(encoding="utf-8") for file in FOLDER.glob("*.txt")}
    shown = {page.file.name: page.text for page in pages}
    assert sorted(stored) == sorted(shown)
    assert [name for name in shown if shown[name] != stored[name]] == []


def test_help_at_80_columns_loses_no_letter_and_breaks_no_sentence(pages: list[Page]) -> None:
    assert len(pages) > 50
    assert [page.words for page in pages if "\N{HORIZONTAL ELLIPSIS}" in page.text] == []
    assert [page.words for page in pages if max(map(len, page.text.splitlines())) > 80] == []
    shown = {page.words: page.text for page in pages}
    assert "The same files give the same run." in " ".join(shown["trials", "run"].split())
    order = ["--robot", "--port", "--set", "Display", "--view-at", "Results", "--out", "Messages"]
    options = shown["run",].partition("─ Options ─")[2]
    places = [options.index(word) for word in order]
    assert places == sorted(places)


def test_the_help_of_a_command_needs_little_time(pages: list[Page]) -> None:
    """Time of the processor: twelve times the usual one, whatever else the machine does."""
    assert [page.words for page in pages[1:] if page.cpu_s > 1.0] == []
