"""``python -m tests.reference``: compare joint commands and wire bytes of ten runs with the file.

A change that moves code leaves every hash as it is. A change that alters packets on purpose writes
the file again, with ``--write``, in a commit of its own that lists what changed.
"""

import argparse
import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from .runs import hashes_of, runs

FILE = Path(__file__).with_name("hashes.json")


def main() -> int:
    """Return 1 if a hash differs from that in the file."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--write", action="store_true", help="write the file again")
    given = options.parse_args()
    known = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    found = {}
    with TemporaryDirectory() as folder:
        for name, prepare in runs(Path(folder)).items():
            found[name] = hashes_of(prepare, Path(folder) / name)
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
