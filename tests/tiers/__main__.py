"""``python -m tests.tiers``: run the fast tests that a change concerns.

The change is everything that differs from the commit that this branch shares with ``main``, or
from ``--since COMMIT``. ``--list`` only prints the files. Other words go to pytest.
"""

import argparse
import os
import sys

from tests.tiers.selection import base, choice_of_change

PROCESSES_ABOVE_S = 20.0
"""Two processes pay above this CPU time: each imports the packages for itself (measured: 6 s)."""


def main() -> None:
    """Print the choice, and run it."""
    parser = argparse.ArgumentParser(prog="python -m tests.tiers", description=__doc__)
    parser.add_argument("--since", help="commit to compare with")
    parser.add_argument("--list", action="store_true", help="print the test files, run nothing")
    given, words = parser.parse_known_args()
    since = given.since or base()
    choice = choice_of_change(since)
    count = len(choice.chosen)
    print(f"since {since[:10]}: {count} test files, about {choice.cpu_s:.0f} s of CPU")
    if choice.left_out:
        print(f"left to `make test`, which runs all: {len(choice.left_out)} files")
        print("".join(f"  {name}\n" for name in choice.left_out), end="")
    if given.list:
        print(*choice.chosen, sep="\n")
        return
    if count == 0:
        print("no test concerns this change")
        return
    if choice.cpu_s > PROCESSES_ABOVE_S:
        words = ["-n", "2", "--dist", "worksteal", *words]
    sys.stdout.flush()
    os.execv(sys.executable, [sys.executable, "-m", "pytest", *words, *choice.chosen])


if __name__ == "__main__":
    main()
