"""Patterns of unclear sentences, and the largest length of a sentence."""

from typing import Final

PATTERNS: Final = {
    "'what ...' or 'who ...' as a noun": (
        r"(?:^|[,;:.] |\b(?:of|for|to|by|with|from|in) )(?:[Ww]hat|[Ww]ho|[Ww]hoever)\b(?!\?)"
    ),
    "a fragment: 'Of ...', 'That of ...', 'Likewise'": (
        r"(?:^|(?<=\. ))(?:Of|That of|Those of|Likewise|So do)\b"
    ),
    "'takes' for accepts, uses, needs": r"\b[Tt]akes?\b",
    "'is none', 'is no X', 'has it that'": r"\b(?:is|are) (?:none|no [a-z]+)\b|\bhas it that\b",
    "'told', 'tells', 'says of'": r"\b(?:told|tells?|says? of)\b",
    "'so many', 'from ... on', 'beside', 'somebody'": (
        r"\b[Ss]o (?:many|long)\b|\b[Bb]eside\b|\b[Ss]omebody\b"
    ),
    "'of now', 'reckon', 'foretold', 'anew', 'mend'": (
        r"\bof now\b|\b[Rr]eckons?\b|\bforetold\b|\banew\b|\b[Mm]end(?:s|ed)?\b"
    ),
    "a metaphor for code: room, house, door, noun": r"\b(?:rooms?|houses?|doors?|nouns?)\b",
}
"""Regular expressions by the name of the pattern; matched against single sentences."""
EXAMPLES: Final = (
    "what moves joints",
    "Of a body: its state",
    "takes a file",
    "there is none",
    "is told by name",
    "kept beside it",
    "said anew",
    "a room of the code",
)
"""A sentence for each pattern, in order, which the pattern must find."""
VAGUE_NAMES: Final = frozenset(
    {
        *("apart", "at", "beside", "each", "found", "held", "helped", "here", "known", "made"),
        *("one", "own", "seen", "spoken", "stands", "told", "wanted", "way", "whole"),
    }
)
"""Words that say nothing about a value if they are its whole name (rule 7 of the style)."""
LONGEST_WORDS: Final = 35
"""A sentence with more words is long."""
