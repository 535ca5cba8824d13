"""List unclear sentences and names, count them, or draw a sample to read without the code.

``python -m tests.prose [KIND] [PLACE]`` lists the findings of a kind of text.
``python -m tests.prose --counts`` counts them.
``python -m tests.prose --sample 60 --seed 1 --kind help`` prints a drawn sample without places.
"""

import argparse
import inspect
import json
import random

from tests.prose.findings import count, findings
from tests.prose.texts import KINDS, NAMES, docstring_texts, help_texts, messages, names

READ_BY_HAND = {
    "docstrings": docstring_texts,
    "help": help_texts,
    "messages": messages,
    NAMES: names,
}
"""Kinds of text of which a sample is read: each text whole."""


def sample(kind: str, size: int, seed: int) -> list[str]:
    """Draw whole texts, or names, of a kind; each wording counts once."""
    wordings = sorted({inspect.cleandoc(text) for _, text in READ_BY_HAND[kind]()} - {""})
    return random.Random(seed).sample(wordings, min(size, len(wordings)))


def main() -> None:
    """Print the findings of a kind of text in places that start with a name, counts or a sample."""
    parser = argparse.ArgumentParser(prog="python -m tests.prose", description=__doc__)
    parser.add_argument("only", nargs="?", help="kind of text whose findings are listed")
    parser.add_argument("place", nargs="?", default="", help="beginning of their places")
    parser.add_argument("--counts", action="store_true", help="count the findings of each kind")
    parser.add_argument("--sample", type=int, default=0, help="number of texts to draw")
    parser.add_argument("--seed", type=int, default=0, help="seed of the drawing")
    parser.add_argument("--kind", choices=READ_BY_HAND, help="kind of text to draw")
    given = parser.parse_args()
    if given.counts:
        print(json.dumps({kind: count(kind) for kind in (*KINDS, NAMES)}, indent=1))
    elif given.sample:
        for kind in [given.kind] if given.kind else READ_BY_HAND:
            print(f"\n{kind}")
            for number, text in enumerate(sample(kind, given.sample, given.seed), start=1):
                print(f"{number:3}. {text}")
    else:
        for kind in [given.only] if given.only else (*KINDS, NAMES):
            for finding in findings(kind):
                if finding.place.startswith(given.place):
                    print(f"{finding.place}: [{finding.pattern}] {finding.sentence}")


if __name__ == "__main__":
    main()
