"""Run the tests on mutants of a module: one collection, then a forked process for each mutant."""

import gc
import json
import math
import os
import resource
import signal
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, Final, NamedTuple

import pytest

from snakewalk.drivers import compiling
from tests.architecture.imports import module_imports, sources
from tests.mutation.mutants import Mutant
from tests.tiers.costs import cpu_s

ROOT: Final = Path(__file__).resolve().parents[2]
STUCK_S: Final = 600
"""Wall time after which a test that waits for ever has noticed its mutant."""
START_S: Final = 10.0
"""Time that a process has beside a multiple of the CPU time of its tests without a mutant."""
TIMES_CPU: Final = 3.0
"""A mutant may need this multiple of the CPU time of its tests."""
TIMES_WALL: Final = 20.0
"""A mutant whose tests wait may need this multiple of their CPU time: the machine may be busy."""
TEST_S: Final = 4.0
"""CPU time of the most expensive test that is run on each mutant."""
WORDS: Final = ("-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--hypothesis-seed=0")
_DECORATORS: Final = "from snakewalk.drivers.compiling import"


class Trial(NamedTuple):
    """Result for a module."""

    survivors: list[int]
    """Indices of the mutants that no test noticed."""
    tests: int
    """Number of tests that were run on each mutant."""
    cpu_s: float
    """Their CPU time on the module as it is."""
    failing: list[str]
    """Tests that fail without a mutant, which makes the trial worthless."""


def path_of(module: str) -> Path:
    """Return the file of a module, as its functions name it."""
    return ROOT / (module.replace(".", "/") + ".py")


def _has_compiled_loops(module: str) -> bool:
    """Return whether numba would load the loops from its cache, without a mutant."""
    file = path_of(module)
    return file.is_file() and _DECORATORS in file.read_text(encoding="utf-8")


def _with_callers(module: str) -> set[str]:
    """Return a module with loops and the modules that compile its loops into theirs."""
    importers = module_imports(sources()).reverse(copy=False)
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in found and _has_compiled_loops(name):
            found.add(name)
            waiting += [f"snakewalk.{each}" for each in importers[name.partition(".")[2]]]
    return found


def _leave_as_python(modules: set[str]) -> None:
    """Have the loops of some modules not compiled when these are imported, and all others be.

    Loops that only run compiled, as the steps of a body, go on if no module of these is below them.
    """

    def kept(decorate: Callable[[Any], Any]) -> Callable[[Any], Any]:
        def decorated(function: Any) -> Any:
            if function.__module__ not in modules:
                return decorate(function)
            function.py_func = function
            return function

        return decorated

    compiled = compiling.compiled
    compiling.compiled = lambda *words, **options: kept(compiled(*words, **options))
    compiling.inlined = kept(compiling.inlined)
    compiling.compiled_when_called = kept(compiling.compiled_when_called)


def _codes(code: CodeType) -> Iterator[CodeType]:
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield constant
            yield from _codes(constant)


def _place(code: CodeType) -> tuple[str, int]:
    return code.co_qualname, code.co_firstlineno


def _functions(file: Path) -> dict[tuple[str, int], list[FunctionType]]:
    """Return every function of a file, wherever something keeps it."""
    gc.unfreeze()
    found: defaultdict[tuple[str, int], list[FunctionType]] = defaultdict(list)
    for kept in gc.get_objects():
        if type(kept) is FunctionType and kept.__code__.co_filename == str(file):
            found[_place(kept.__code__)].append(kept)
    return found


def _file_of(name: str) -> str:
    """Return the file of a test, by the name of the test."""
    return name.partition("::")[0]


class _Forks:
    """A plugin of pytest that runs the tests on each mutant, the cheapest files first."""

    def __init__(self, file: Path, mutants: Sequence[Mutant], budget_s: float) -> None:
        self._file = file
        self._mutants = mutants
        self._budget_s = budget_s
        self._out: int | None = None
        self._start_s = 0.0
        self._used_s = 0.0
        self._failed: set[str] = set()
        self.is_child = False
        self.trial: Trial | None = None

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool | None:
        """Fork; a child returns None, and pytest runs its tests.

        A file that cannot be collected, as one of a loop's machine code, has no tests here.
        """
        import_module("snakewalk.controller.report.figures.sections")  # by a fixture, in each fork
        session.testsfailed = 0
        functions = _functions(self._file)
        read, write = os.pipe()
        if self._fork(5.0 * self._budget_s, STUCK_S) == 0:
            self._out = write
            return None
        os.close(write)
        with os.fdopen(read) as lines:
            measured = [json.loads(line) for line in lines]
        os.wait()
        kept_s = {name: s for name, s, passed in measured if passed and s <= TEST_S}
        files_s: Counter[str] = Counter()
        for name, spent_s in kept_s.items():
            files_s[_file_of(name)] += spent_s
        kept = [item for item in session.items if item.nodeid in kept_s]
        session.items = sorted(kept, key=lambda item: files_s[_file_of(item.nodeid)])
        all_s = files_s.total()
        survivors = []
        for index, mutant in enumerate(self._mutants if kept_s else ()):
            if self._fork(START_S + TIMES_CPU * all_s, START_S + TIMES_WALL * all_s) == 0:
                self._apply(mutant, functions)
                session.config.option.maxfail = 1
                return None
            if os.waitstatus_to_exitcode(os.wait()[1]) == 0:
                survivors.append(index)
        failing = [name for name, _, passed in measured if not passed]
        self.trial = Trial(survivors, len(kept_s), all_s, failing)
        return True

    def _fork(self, limit_s: float, stuck_s: float) -> int:
        child = os.fork()
        if child == 0:
            self.is_child = True
            signal.alarm(math.ceil(stuck_s))
            used_s = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
            resource.setrlimit(resource.RLIMIT_CPU, (int(used_s + limit_s) + 1,) * 2)
        return child

    def pytest_runtest_protocol(self) -> bool | None:
        """Leave out the tests that the budget does not allow."""
        return True if self._out is not None and self._used_s > self._budget_s else None

    def pytest_runtest_logstart(self) -> None:
        self._start_s = cpu_s()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self._failed.add(report.nodeid)

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        if self._out is not None:
            spent_s = cpu_s() - self._start_s
            self._used_s += spent_s
            line = json.dumps([nodeid, spent_s, nodeid not in self._failed])
            os.write(self._out, f"{line}\n".encode())

    def _apply(self, mutant: Mutant, functions: dict[tuple[str, int], list[FunctionType]]) -> None:
        for code in _codes(compile(mutant.tree, str(self._file), "exec")):
            for function in functions.get(_place(code), ()):
                if len(code.co_freevars) == len(function.__code__.co_freevars):
                    function.__code__ = code


def try_mutants(
    module: str, mutants: Sequence[Mutant], files: Sequence[str], budget_s: float
) -> Trial:
    """Run the tests of ``files`` on each mutant, in processes of their own.

    Tests are left out after ``budget_s`` of CPU. A module with compiled loops is tested as Python.
    """
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        silent = os.open(os.devnull, os.O_WRONLY)
        if not os.environ.get("MUTATION_LOUD"):
            os.dup2(silent, 1)
            os.dup2(silent, 2)
        _leave_as_python(_with_callers(module))
        forks = _Forks(path_of(module), mutants, budget_s)
        code = pytest.main([*WORDS, "--continue-on-collection-errors", *files], plugins=[forks])
        if not forks.is_child and forks.trial is not None:
            with os.fdopen(write, "w") as out:
                json.dump(forks.trial, out)
        os._exit(int(code))
    os.close(write)
    with os.fdopen(read) as lines:
        said = lines.read()
    os.waitpid(child, 0)
    if not said:
        raise RuntimeError(f"{module}: pytest ended before a mutant was tried")
    return Trial(*json.loads(said))
