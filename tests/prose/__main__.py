"""List unclear sentences: `python -m tests.prose [KIND] [PLACE]`; `--counts` counts them."""

import json
import sys

from tests.prose.findings import count, findings
from tests.prose.texts import KINDS


def main(words: list[str]) -> None:
    """Print the findings of a kind of text in places that start with a name, or all counts."""
    if "--counts" in words:
        print(json.dumps({kind: count(kind) for kind in KINDS}, indent=1))
        return
    kinds = [words[0]] if words else list(KINDS)
    place = words[1] if len(words) > 1 else ""
    for kind in kinds:
        for finding in findings(kind):
            if finding.place.startswith(place):
                print(f"{finding.place}: [{finding.pattern}] {finding.sentence}")


if __name__ == "__main__":
    main(sys.argv[1:])
