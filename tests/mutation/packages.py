"""Which module of each package is mutated, and which tests are near it."""

import json
import random
import re
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import PurePosixPath
from typing import Final

import networkx as nx

from tests.architecture.imports import ROOT, module_imports, read_folder, sources
from tests.architecture.layout import ORDER, package_of
from tests.mutation.mutants import Mutant
from tests.tiers.selection import CPU_S, distances, mirrored_folder, texts_of_tests

LINES: Final = 100
"""A drawn module has more lines, if the package has such a module."""
FILES: Final = 6
"""Test files that are run on a mutant: those nearest to its module."""
FURTHER_FILES: Final = 12
"""Test files after these that are run on the mutants that are left."""
ALWAYS: Final = ("controller.images.silhouette", "controller.track.analysis")
"""Modules whose evidence once was in expensive tests only."""

PAGE: Final = ROOT / "docs" / "mutation.md"
ELSEWHERE: Final = ("sim.batch.kernels", "sim.batch.warp_bodies")
"""Modules that need Warp, whose tests run in an environment of their own (``make warp``)."""


@cache
def _imports() -> nx.DiGraph:
    return module_imports({**sources(), **read_folder("tests")})


def drawn_modules() -> Iterator[tuple[str, str]]:
    """Yield each package with a module of it, without ``snakewalk``.

    A module that has a row of the page stays drawn while it exists.
    """
    rows = re.findall(r"^\| `([\w.]+)` \| `([\w.]+)` \|", PAGE.read_text(encoding="utf-8"), re.M)
    for module in ALWAYS:
        yield package_of(module), module
    lines = {
        module: len(file.read_text(encoding="utf-8").splitlines())
        for module in sources()
        if module not in ELSEWHERE and (file := ROOT / f"{module.replace('.', '/')}.py").is_file()
    }
    for package in (package for order in ORDER.values() for package in order):
        modules = sorted(module for module in lines if package_of(module) == package)
        large = [module for module in modules if lines[module] > LINES]
        measured = [
            module
            for of, module in rows
            if of == package and module in modules and module not in ALWAYS
        ]
        if modules:
            yield package, measured[0] if measured else random.Random(0).choice(large or modules)


def sample(mutants: Sequence[Mutant], count: int) -> list[Mutant]:
    """Draw mutants by seed 0; all of them if there are few."""
    if len(mutants) <= count:
        return list(mutants)
    return random.Random(0).sample(mutants, count)


def nearest_tests(module: str) -> list[str]:
    """Return the test files that a module reaches: of its name, then of its package."""
    path = module.replace(".", "/") + ".py"
    stem = PurePosixPath(path).stem
    by_import = distances([path], _imports(), texts_of_tests())
    cpu_s = json.loads(CPU_S.read_text(encoding="utf-8"))
    words = set(stem.split("_"))
    mirror = mirrored_folder(path, {str(PurePosixPath(test).parent) for test in by_import})

    def rank(test: str) -> tuple[object, ...]:
        file = PurePosixPath(test)
        shared = words & set(file.stem.split("_"))
        is_indirect = not _imports().has_edge(test.removesuffix(".py").replace("/", "."), module)
        is_apart = str(file.parent) != mirror
        return is_indirect, -len(shared), is_apart, by_import[test], cpu_s.get(test, 0.0), test

    return sorted(by_import, key=rank)
