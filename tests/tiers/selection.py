"""The test files that a change concerns, the nearest first, within a budget of CPU time."""

import json
import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final

import networkx as nx

from tests.architecture.imports import ROOT, module_imports, read_folder, sources
from tests.architecture.layout import TOPS

BUDGET_S: Final = 75.0
"""CPU time of the chosen files; two processes and their start then need less than 60 s (ours)."""
FILE_S: Final = 0.3
"""CPU time for importing a test file in the processes of a run (measured: 0.2 to 0.4 s)."""
CPU_S: Final = Path(__file__).with_name("cpu_s.json")
"""CPU time of the fast tests of each file that needs more than a second."""


@dataclass(frozen=True)
class Choice:
    """Test files of a change."""

    chosen: list[str]
    """Paths, the nearest first."""
    left_out: list[str]
    """Paths that the budget does not allow."""
    cpu_s: float
    """Expected CPU time of the chosen files."""


def _git(*words: str) -> list[str]:
    out = subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True)
    return out.stdout.splitlines()


def base() -> str:
    """Return the newest commit that this branch shares with a ``main`` other than itself."""
    current = _git("rev-parse", "--symbolic-full-name", "HEAD")
    mains = _git("for-each-ref", "--format=%(refname)", "refs/heads/main", "refs/remotes/*/main")
    shared = [_git("merge-base", "HEAD", main)[0] for main in mains if main not in current]

    def commits_since(commit: str) -> int:
        return int(_git("rev-list", "--count", f"{commit}..HEAD")[0])

    return min(shared, key=commits_since, default="HEAD")


def changed_files(since: str) -> list[str]:
    """Return the paths that differ from a commit, and the new ones."""
    return sorted(
        {*_git("diff", "--name-only", since), *_git("ls-files", "--others", "--exclude-standard")}
    )


def _module(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def texts_of_tests() -> dict[str, str]:
    """Return the text of every test file by its path."""
    return {
        file.relative_to(ROOT).as_posix(): file.read_text(encoding="utf-8")
        for file in sorted((ROOT / "tests").rglob("test_*.py"))
    }


def mirrored_folder(path: str, folders: Iterable[str]) -> str | None:
    """Return the folder of the tests of a package's file: the deepest that exists."""
    known = set(folders)
    parents = (f"tests/{parent}" for parent in PurePosixPath(path).parents)
    return next((parent for parent in parents if parent in known), None)


def distances(
    changed: Iterable[str], imports: nx.DiGraph, tests: Mapping[str, str]
) -> dict[str, int]:
    """Return how many imports lie between a change and each test file that it reaches.

    ``imports`` has an arrow from each module to those that it imports; ``tests`` has the text of
    every test file by its path. A changed test has distance 0. The tests of the folder that
    mirrors a changed file's package have distance 1, as have tests that name a changed file of
    another kind.
    """
    folders = {str(PurePosixPath(test).parent) for test in tests}
    by_module = {_module(test): test for test in tests}
    reached: dict[str, int] = {}

    def add(test: str, distance: int) -> None:
        reached[test] = min(distance, reached.get(test, distance))

    for path in changed:
        file = PurePosixPath(path)
        if path in tests:
            add(path, 0)
        if path.split("/")[0] in TOPS:
            folder = mirrored_folder(path, folders)
            for test in tests:
                if str(PurePosixPath(test).parent) == folder:
                    add(test, 1)
        if file.name == "conftest.py":
            for test in tests:
                if test.startswith(f"{file.parent}/"):
                    add(test, 1)
        elif file.suffix == ".py":
            importers = imports.reverse(copy=False)
            if _module(path) in importers:
                lengths = nx.single_source_shortest_path_length(importers, _module(path))
                for module, length in lengths.items():
                    if module in by_module:
                        add(by_module[module], length)
        else:
            for test, text in tests.items():
                if file.name in text or (file.suffix == ".toml" and f'"{file.stem}"' in text):
                    add(test, 1)
    return reached


def choose(distance: Mapping[str, int], cpu_s: Mapping[str, float], budget_s: float) -> Choice:
    """Choose the nearest files, the cheapest first; changed tests are always chosen."""
    chosen: list[str] = []
    left_out: list[str] = []
    used_s = 0.0
    for test in sorted(distance, key=lambda t: (distance[t], cpu_s.get(t, 0.0), t)):
        cost_s = FILE_S + cpu_s.get(test, 0.0)
        if distance[test] == 0 or used_s + cost_s <= budget_s:
            used_s += cost_s
            chosen.append(test)
        else:
            left_out.append(test)
    return Choice(chosen, left_out, used_s)


def choice_of_change(since: str) -> Choice:
    """Return the test files for everything that differs from a commit."""
    imports = module_imports({**sources(), **read_folder("tests")})
    cpu_s = json.loads(CPU_S.read_text(encoding="utf-8"))
    return choose(distances(changed_files(since), imports, texts_of_tests()), cpu_s, BUDGET_S)
