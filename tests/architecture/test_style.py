"""Names and sentences of the code: the rules that can be checked, and counts that only fall."""

import ast
import io
import re
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

import pytest

from tests.architecture.layout import TOPS
from tests.architecture.test_layout import sources

ROOT = Path(__file__).resolve().parents[2]
PATTERNS = {
    "'what ...' or 'who ...' as a noun": (
        r"(?:^|[,;:.] |\b(?:of|for|to|by|with|from|in) )(?:what|who|whoever)\b(?!\?)"
    ),
    "a fragment: 'Of ...', 'That of ...', 'Likewise'": (
        r"(?:^|(?<=\. ))(?:Of|That of|Those of|Likewise|So do)\b"
    ),
    "'takes' for accepts, uses, needs": r"\btakes?\b",
    "'is none', 'is no X', 'has it that'": r"\b(?:is|are) (?:none|no [a-z]+)\b|\bhas it that\b",
    "'told', 'tells', 'says of'": r"\b(?:told|tells?|says? of)\b",
    "'so many', 'from ... on', 'beside', 'somebody'": (
        r"\bso (?:many|long)\b|\bbeside\b|\bsomebody\b"
    ),
    "'of now', 'reckon', 'foretold', 'anew', 'mend'": (
        r"\bof now\b|\breckons?\b|\bforetold\b|\banew\b|\bmend(?:s|ed)?\b"
    ),
    "a metaphor for code: room, house, door, noun": r"\b(?:rooms?|houses?|doors?|nouns?)\b",
}
"""Patterns that are to be removed from docstrings and comments."""
MOST: Final = {
    "'what ...' or 'who ...' as a noun": 351,
    "a fragment: 'Of ...', 'That of ...', 'Likewise'": 226,
    "'takes' for accepts, uses, needs": 221,
    "'is none', 'is no X', 'has it that'": 193,
    "'told', 'tells', 'says of'": 143,
    "'so many', 'from ... on', 'beside', 'somebody'": 155,
    "'of now', 'reckon', 'foretold', 'anew', 'mend'": 26,
    "a metaphor for code: room, house, door, noun": 18,
}
"""Occurrences that are left; a count that falls is lowered here, none rises."""


@cache
def texts() -> tuple[str, ...]:
    """Every docstring and comment of the library."""
    return tuple(
        text
        for top in TOPS
        for file in sorted((ROOT / top).rglob("*.py"))
        for text in texts_of(file.read_text(encoding="utf-8"))
    )


def texts_of(source: str) -> Iterator[str]:
    """Docstrings, strings below attributes, and comments of a file."""
    for node in ast.walk(ast.parse(source)):
        value = node.value if isinstance(node, ast.Expr) else None
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            yield " ".join(value.value.split())
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and "noqa" not in token.string:
            yield token.string.lstrip("#: ")


def counted() -> Counter[str]:
    """Occurrences of each pattern."""
    found: Counter[str] = Counter()
    for name, pattern in PATTERNS.items():
        found[name] = sum(len(re.findall(pattern, text)) for text in texts())
    return found


@pytest.mark.parametrize("name", PATTERNS)
def test_no_pattern_becomes_more_frequent(name: str) -> None:
    assert counted()[name] <= MOST[name]


def test_the_patterns_find_their_examples() -> None:
    examples = (
        "what moves joints",
        "Of a body: its state",
        "takes a file",
        "there is none",
        "is told by name",
        "kept beside it",
        "said anew",
        "a room of the code",
    )
    for pattern, example in zip(PATTERNS.values(), examples, strict=True):
        assert re.search(pattern, example), example


def test_no_public_class_name_is_defined_in_two_files() -> None:
    files: dict[str, set[str]] = defaultdict(set)
    for module, source in sources().items():
        for name in source.classes:
            if not name.startswith("_"):
                files[name].add(module)
    assert not {name: sorted(of) for name, of in files.items() if len(of) > 1}
