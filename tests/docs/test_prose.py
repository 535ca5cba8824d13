"""Unclear sentences in pages, help, messages and docstrings become fewer."""

import json
import re
from pathlib import Path

import pytest

from tests.prose.findings import LONG, VAGUE, count
from tests.prose.patterns import EXAMPLES, PATTERNS
from tests.prose.texts import KINDS, NAMES, docstring_paragraphs, page_paragraphs, sentences

pytestmark = pytest.mark.costs("reads every text of the project")

MOST = json.loads((Path(__file__).parent / "most_findings.json").read_text(encoding="utf-8"))
"""Findings that are left by kind and pattern. A count that falls is lowered here; none rises."""
VAGUE_PER_1000 = 1.8
"""Largest share of bound names that are a word of rule 7 of the style, such as ``found``."""
LONG_SHARE = 0.02
"""Largest share of long sentences."""


@pytest.mark.parametrize("kind", KINDS)
def test_no_pattern_becomes_more_frequent(kind: str) -> None:
    counts = count(kind)
    more = {name: (counts[name], most) for name, most in MOST[kind].items() if counts[name] > most}
    assert not more, f"list them: python -m tests.prose {kind}"


def test_few_names_say_nothing_about_their_value() -> None:
    counts = count(NAMES)
    assert 1000 * counts[VAGUE] <= VAGUE_PER_1000 * counts["sentences"], (
        "list them: python -m tests.prose names"
    )


@pytest.mark.parametrize("kind", ["help", "messages", "pages"])
def test_few_sentences_are_long(kind: str) -> None:
    counts = count(kind)
    assert counts[LONG] < LONG_SHARE * counts["sentences"]


def test_the_patterns_find_their_examples() -> None:
    for pattern, example in zip(PATTERNS.values(), EXAMPLES, strict=True):
        assert re.search(pattern, example), example


def test_a_page_is_divided_into_its_sentences() -> None:
    page = "# A title\n\nOne. Two\nlines.\n\n```\nnot this\n```\n- item\n\n| a | b |\n| - | - |\n"
    assert [one for text in page_paragraphs(page) for one in sentences(text)] == [
        "A title", "One.", "Two lines.", "item", "a", "b",
    ]  # fmt: skip


def test_each_item_of_a_docstring_is_a_text() -> None:
    docstring = """Summary.

    Text of
    two lines:
    - an item
      of two lines
    - another

        a = code

    Args:
        beside: folder of
            the file.
        low, high: limits.

    Raises:
        ConfigError: the file is missing.
    """
    assert list(docstring_paragraphs(docstring)) == [
        "Summary.", "Text of two lines:", "an item of two lines", "another",
        "folder of the file.", "limits.", "the file is missing.",
    ]  # fmt: skip
