"""``.ci/install``, by which ``make`` installs: uv or pip, and not a word unless one fails."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

INSTALL = Path(__file__).resolve().parents[2] / ".ci" / "install"

PIP = f"""#!{sys.executable}
import os, sys
words = sys.argv[1:]
if words[0] == "config":
    try:  # more than a pipe holds: who stops reading is told of
        print(os.environ["TOLD"], *(f"global.x{{i}}='y'" for i in range(9999)), sep="\\n")
        sys.stdout.flush()
    except BrokenPipeError:
        print("ERROR: Pipe to stdout was broken", file=sys.stderr)
        os._exit(1)
    raise SystemExit
print("WARNING: Location is ignored", file=sys.stderr) if "-qq" not in words else None
open("asked", "a").write("pip " + " ".join(words) + "\\n")
if "nosuch" in words:
    print("ERROR: No matching distribution found for nosuch", file=sys.stderr)
    raise SystemExit(1)
"""
UV = """#!/bin/sh
[ "$1" = --version ] && exit 0
echo "uv $*" >> asked
case "$*" in *nosuch*) exit 1;; esac
"""
CONSTRAINED = "global.constraint='/etc/constraints.txt'"


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("told", "package", "by", "code"),
    [
        (CONSTRAINED, "numpy", ["pip"], 0),
        ("global.timeout='9'", "numpy", ["uv"], 0),
        (CONSTRAINED, "nosuch", ["pip"], 1),
        ("global.timeout='9'", "nosuch", ["uv", "pip"], 1),
    ],
)
def test_only_a_failure_is_told(
    told: str, package: str, by: list[str], code: int, tmp_path: Path
) -> None:
    for name, text in {"pip": PIP, "uv": UV}.items():
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    done = subprocess.run(
        [str(INSTALL), str(tmp_path), "--no-deps", package],
        cwd=tmp_path,
        env=os.environ | {"TOLD": told},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    asked = (tmp_path / "asked").read_text().splitlines()
    assert [line.split()[0] for line in asked] == by
    assert all(line.endswith(f"--no-deps {package}") for line in asked)
    assert done.returncode == code
    assert (done.stdout + done.stderr).splitlines() == (
        ["ERROR: No matching distribution found for nosuch"] if code else []
    )
