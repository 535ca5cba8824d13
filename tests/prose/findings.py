"""Sentences that match a pattern or are long."""

import re
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

from tests.prose.patterns import LONGEST_WORDS, PATTERNS, VAGUE_NAMES
from tests.prose.texts import NAMES, read

VAGUE = "a name that says nothing about its value"
LONG = f"more than {LONGEST_WORDS} words"


class Finding(NamedTuple):
    """A sentence, its place, and its pattern."""

    place: str
    pattern: str
    sentence: str


def words_of(sentence: str) -> int:
    """Return the number of words of a sentence."""
    return len(re.findall(r"[A-Za-z0-9][\w.,'/:-]*", sentence))


def findings(kind: str) -> Iterator[Finding]:
    """Yield the findings of a kind of text."""
    for place, sentence in read(kind):
        if kind == NAMES:
            if sentence.strip("_") in VAGUE_NAMES:
                yield Finding(place, VAGUE, sentence)
            continue
        for name, pattern in PATTERNS.items():
            for _ in re.findall(pattern, sentence):
                yield Finding(place, name, sentence)
        if words_of(sentence) > LONGEST_WORDS:
            yield Finding(place, LONG, sentence)


@cache
def count(kind: str) -> dict[str, int]:
    """Return the number of findings of each pattern, and of all sentences or names."""
    counts = dict.fromkeys([VAGUE] if kind == NAMES else [*PATTERNS, LONG], 0)
    for finding in findings(kind):
        counts[finding.pattern] += 1
    return {**counts, "sentences": len(read(kind))}
