"""Readers in a process of their own: some libraries end the process on a damaged file."""

import json
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from snakewalk.config.archive import check_expansion, parse_json
from snakewalk.config.errors import InputError, first_line
from snakewalk.controller.console.child_process import run_limited

_MOST_MEMORY_BYTES = 3_000_000_000
_MOST_CPU_S = 600
"""Limits of the process that reads a file (ours)."""
_CHILD = """
from snakewalk.controller.console.separate_reader import child
print(child(*words))
"""


def read_separately(
    file: Path, module: str, *choices: object
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read a file by ``module.child(file, *choices)``; return its arrays, and facts of JSON.

    Raises:
        InputError: the file is damaged, or needs too much memory or time.

    """
    with TemporaryDirectory() as folder:
        out = Path(folder) / "arrays.npz"
        words = json.dumps([str(file), *choices])
        most = _MOST_MEMORY_BYTES, _MOST_CPU_S
        ended = run_limited(_CHILD, module, words, str(out), most=most)
        try:
            facts: dict[str, Any] = parse_json(ended.stdout)
        except ValueError:
            raise InputError(
                f"{file}: is damaged: its decoder gave up, or needed over "
                f"{_MOST_MEMORY_BYTES / 1e9:g} GB or {_MOST_CPU_S} s; copy or export it again"
            ) from None
        if "fault" in facts:
            raise InputError(f"{file}: {facts['fault']}")
        check_expansion(file, file.stat().st_size, out.stat().st_size)
        with np.load(out) as arrays:
            return dict(arrays), facts


def child(module: str, words: str, out: str) -> str:
    """Work of the other process: store the arrays; the facts as JSON."""
    try:
        arrays, facts = import_module(module).child(*parse_json(words))
        np.savez(out, **arrays)
    except InputError as error:
        facts = {"fault": str(error)}
    except Exception as error:  # a library raises the exceptions of its parsers
        facts = {"fault": f"cannot be read: {first_line(error)}; copy or export it again"}
    return json.dumps(facts)
