"""``python -m tests.mutation``: run the tests on mutants; writes ``docs/mutation.md``.

Without words it tries every mutant of the modules that safety depends on (``TARGETS``). A mutant
that no test notices must be explained in ``explained.toml``; otherwise the exit code is 1.

``packages`` tries a sample of mutants of one module of each package with the fast tests near it;
names after it choose packages or modules. The exit code is 1 if a share is below ``SHARE``.
"""

import argparse
import ast
import os
import resource
import signal
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType

import hypothesis  # noqa: F401  loaded once, for all forks
import numpy  # noqa: F401
import pytest
from rich.console import Console
from rich.progress import track

from tests.mutation.mutants import Mutant, mutants
from tests.mutation.packages import (
    FILES,
    FURTHER_FILES,
    PAGE,
    drawn_modules,
    nearest_tests,
    sample,
)
from tests.mutation.trial import ROOT, STUCK_S, WORDS, path_of, try_mutants

EVERY, PACKAGES = "mutation", "packages"
SHARE = 0.8
"""Least share of noticed mutants in a package."""
SAMPLE = 8
"""Mutants of a module that are tried."""
BUDGET_S = 8.0
"""CPU time of the tests that are run on a mutant of a package."""
TIME_LIMIT_S = 60
"""CPU time of the tests on one mutant of the safety code."""
TARGETS = {
    "snakewalk.drivers.safety.vet": (
        "test_safety_edges.py",
        "test_safety_vet.py",
        "test_safe_link.py",
    ),
    "snakewalk.drivers.safety.following_error": (
        *("test_following_error.py", "test_constant_current.py"),
    ),
    "snakewalk.drivers.safety.measured_step": ("test_measured_step.py",),
    "snakewalk.drivers.chain.goal_check": ("test_goal_check_edges.py",),
    "snakewalk.drivers.chain.fingerprint": ("test_fingerprint.py",),
    "snakewalk.drivers.chain.temperature_sensors": ("test_temperature_sensors.py",),
    "snakewalk.drivers.chain.motion_sensors": (
        *("test_motion_sensors_edges.py", "test_motion_sensors.py"),
    ),
    "snakewalk.drivers.chain.lost_replies": ("test_lost_replies.py",),
    "snakewalk.drivers.protocol.parser": (
        *("test_reader_edges.py", "test_packet_reader.py", "test_packets.py"),
        "test_crc_and_stuffing.py",
    ),
    "snakewalk.drivers.protocol.packet": (
        *("test_reader_edges.py", "test_packets.py", "test_crc_and_stuffing.py"),
    ),
}


def survives(module: str, tree: ast.AST, files: list[str]) -> bool:
    """Whether no test fails on a fresh import of ``tree``; one that runs for ever does not."""
    child = os.fork()
    if child == 0:
        os._exit(_try(module, tree, files))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def _try(module: str, tree: ast.AST, files: list[str]) -> int:
    os.environ["NUMBA_DISABLE_JIT"] = "1"  # a mutant's loops run as they stand
    resource.setrlimit(resource.RLIMIT_CPU, (TIME_LIMIT_S, TIME_LIMIT_S))
    signal.alarm(STUCK_S)
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    changed = ModuleType(module)
    changed.__file__ = str(path_of(module))
    sys.modules[module] = changed
    try:
        exec(compile(tree, changed.__file__, "exec"), changed.__dict__)
        parent, _, name = module.rpartition(".")
        setattr(__import__(parent, fromlist=[name]), name, changed)
    except Exception:
        return 1
    return int(pytest.main(["-x", *WORDS, *files]))


def try_every(modules: list[str]) -> tuple[list[str], list[str]]:
    """Try all mutants of the modules of safety; return lines of the page, and unexplained ones."""
    rows, unexplained = [], []
    for module in track(modules, "modules", console=Console(stderr=True)):
        source = path_of(module).read_text(encoding="utf-8")
        every = list(mutants(source))
        print_stale(module, every)
        drivers = ROOT / "tests" / "drivers"
        files = [str(file) for name in TARGETS[module] for file in drivers.rglob(name)]
        if not survives(module, ast.parse(source), files):
            raise SystemExit(f"{module}: its tests fail without a mutant; run pytest on them")
        survivors = [mutant for mutant in every if survives(module, mutant.tree, files)]
        known = explanations(module)
        for mutant in survivors:
            if mutant.name not in known:
                unexplained.append(f"{module}:{mutant.line}: {mutant.name}")
        noticed = len(every) - len(survivors)
        rows.append(f"| `{module}` | {len(every)} | {noticed} | {len(survivors)} |")
    head = ["| module | mutants | noticed | surviving, explained |", "| --- | ---: | ---: | ---: |"]
    return [*head, *rows], unexplained


def survivors_of(module: str, tried: list[Mutant], files: list[str]) -> list[Mutant]:
    """Return the mutants of a module that no test of the files notices.

    Tests that fail without a mutant are left out and named: some do as Python, some in a fork.
    """
    if not tried or not files:
        return tried
    trial = try_mutants(f"snakewalk.{module}", tried, files, BUDGET_S)
    for name in trial.failing:
        print(f"{module}: left out, fails without a mutant: {name}", file=sys.stderr)
    return tried if trial.tests == 0 else [tried[index] for index in trial.survivors]


def explanations(module: str) -> Mapping[str, str]:
    """Return why mutants of a module change nothing that a test could notice, by name."""
    text = Path(__file__).with_name("explained.toml").read_text(encoding="utf-8")
    found: Mapping[str, str] = tomllib.loads(text).get(module, {})
    return found


def print_stale(module: str, every: list[Mutant]) -> None:
    """Report the explanations of a module that name no mutant, because its code has changed."""
    known = explanations(module)
    names = {mutant.name for mutant in every} if known else set()
    for name in known.keys() - names:
        print(f"explained.toml: {module}: no mutant has this name: {name}", file=sys.stderr)


def try_packages(names: list[str], count: int) -> Iterator[tuple[str, str, bool]]:
    """Try a sample of each drawn module; yield it, its row of the page, and if it passes.

    The share is that of the mutants that are not explained.
    """
    for package, module in drawn_modules():
        if names and package not in names and module not in names:
            continue
        source = path_of(f"snakewalk.{module}").read_text(encoding="utf-8")
        every = list(mutants(source))
        print_stale(f"snakewalk.{module}", every)
        drawn = sample(every, count)
        if not drawn:
            yield module, f"| `{package}` | `{module}` | 0 | 0 | 0 | |", True
            continue
        near = nearest_tests(module)
        left = survivors_of(module, drawn, near[:FILES])
        left = survivors_of(module, left, near[FILES : FILES + FURTHER_FILES])
        known = explanations(f"snakewalk.{module}")
        explained = [mutant for mutant in left if mutant.name in known]
        for mutant in left:
            if mutant.name not in known:
                print(f"{module}:{mutant.line}: {mutant.name}", file=sys.stderr)
        noticed = len(drawn) - len(left)
        meant = len(drawn) - len(explained)
        share = noticed / meant if meant else 1.0
        numbers = f"{len(drawn)} | {noticed} | {len(explained)} | {100 * share:.0f} %"
        yield module, f"| `{package}` | `{module}` | {numbers} |", share >= SHARE


def lines_between(marker: str) -> list[str]:
    """Return the lines of the page that a marker encloses."""
    text = PAGE.read_text(encoding="utf-8")
    return (
        text.split(f"<!-- {marker} begins -->\n")[1]
        .split(f"<!-- {marker} ends -->")[0]
        .splitlines()
    )


def write_between(marker: str, lines: list[str]) -> None:
    """Replace the lines of the page that a marker encloses."""
    begin, end = f"<!-- {marker} begins -->", f"<!-- {marker} ends -->"
    text = PAGE.read_text(encoding="utf-8")
    shown = "\n".join(lines)
    PAGE.write_text(
        f"{text.split(begin)[0]}{begin}\n{shown}\n{end}{text.split(end)[-1]}", encoding="utf-8"
    )


def joined_rows(lines: list[str], rows: Mapping[str, str]) -> list[str]:
    """Return the table with new rows in place of those of the same modules."""
    kept = {line.split("|")[2].strip(" `"): line for line in lines[2:]}
    drawn = [module for _, module in drawn_modules()]
    every = {**kept, **rows}
    return [*lines[:2], *(every[module] for module in dict.fromkeys(drawn) if module in every)]


def main() -> None:
    """Try the named modules, or all, and write the tables."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("names", nargs="*", help="modules; or 'packages', and names of packages")
    parser.add_argument("--sample", type=int, default=SAMPLE, help="mutants of each package")
    given = parser.parse_args()
    if given.names[:1] == [PACKAGES]:
        rows, failed = {}, []
        for module, row, passes in try_packages(given.names[1:], given.sample):
            failed += [] if passes else [module]
            print(row, flush=True)
            rows[module] = row
            write_between(PACKAGES, joined_rows(lines_between(PACKAGES), rows))
        if failed:
            print(f"below {100 * SHARE:.0f} %:", *failed, sep="\n", file=sys.stderr)
            raise SystemExit(1)
        return
    lines, unexplained = try_every(given.names or list(TARGETS))
    print(*lines, sep="\n")
    if not given.names:
        write_between(EVERY, lines)
    if unexplained:
        print("not explained:", *unexplained, sep="\n", file=sys.stderr)
        raise SystemExit(1)


if __name__ == "__main__":
    main()
