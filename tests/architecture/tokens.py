"""Size of the code in tokens: ``python -m tests.architecture.tokens`` prints it for each package.

A token is a name, a number or a string that is not a docstring. Operators, comments, docstrings and
layout do not count, so code has the same size however it is laid out. A formatted string is one
token. ``--files`` lists the files, the largest first.
"""

import re
import sys
from collections import Counter
from pathlib import Path
from typing import Final

from tests.architecture.layout import TOPS, package_of

ROOT: Final = Path(__file__).resolve().parents[2]
TOKEN: Final = re.compile(
    r'''(?P<docstring>^[ ]*[rR]?"""(?:\\.|[^\\])*?""")
    |(?P<comment>\#[^\n]*)
    |(?P<counted>
        [rRbBfFuU]{0,2}(?:"""(?:\\.|[^\\])*?"""|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\')
        |\.?\d(?:[eE][+-]|[\w.])*
        |\w+)''',
    re.VERBOSE | re.MULTILINE | re.DOTALL,
)
"""A docstring in three quotes at the begin of a line, a comment, or a string, number or name.

Python's own ``tokenize`` finds the same tokens in ten times the time.
"""


def tokens(text: str) -> int:
    """Return the number of tokens of a module's text."""
    return sum(found.lastgroup == "counted" for found in TOKEN.finditer(text))


def sizes() -> dict[Path, int]:
    """Return the number of tokens of each file of the library."""
    files = (file for top in TOPS for file in sorted((ROOT / top).rglob("*.py")))
    return {file: tokens(file.read_text(encoding="utf-8")) for file in files}


def by_package(files: dict[Path, int]) -> Counter[str]:
    """Return the number of tokens of each package."""
    counts: Counter[str] = Counter()
    for file, count in files.items():
        module = file.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".")
        counts[package_of(module)] += count
    return counts


def main() -> None:
    """Print the sizes, and their sum."""
    files = sizes()
    rows: Counter[str] = by_package(files)
    if "--files" in sys.argv:
        rows = Counter({file.relative_to(ROOT).as_posix(): n for file, n in files.items()})
    for name, count in rows.most_common():
        print(f"{count:>7} {name}")
    print(f"{rows.total():>7} in all")


if __name__ == "__main__":
    main()
