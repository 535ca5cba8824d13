"""``python -m tests.reference``: compare joint commands and bytes of thirteen runs with the file.

A change that moves code leaves every hash as it is. A change that alters packets on purpose writes
the file again, with ``--write``, in a commit of its own that lists what changed.
"""

import argparse
import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.reference.runs import hashes_of, runs

FILE = Path(__file__).with_name("hashes.json")


def main() -> int:
    """Return 1 if a hash differs from that in the file."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--write", action="store_true", help="write the file again")
    options.add_argument("--logs", type=Path, help="folder that keeps the logs, to compare them")
    given = options.parse_args()
    known = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    found = {}
    with TemporaryDirectory() as temporary:
        folder = given.logs or Path(temporary)
        for name, run in runs(folder).items():
            found[name] = hashes_of(run, folder / name)
            differing = [
                key for key, value in found[name].items() if value != known.get(name, {}).get(key)
            ]
            print(
                f"{name}: {'same' if not differing else 'differs: ' + ', '.join(differing)}",
                flush=True,
            )
    if given.write:
        FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return int(found != known and not given.write)


if __name__ == "__main__":
    sys.exit(main())
