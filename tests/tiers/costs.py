"""A plugin of pytest: the CPU time of each test, and the markers of the tiers.

The CPU time is of the process and of all its descendants, in user and system mode. Fixtures of a
class, module or session and the first import of a module are counted apart, because they serve
other tests too. A test above the limit is measured again, alone and after everything that it
compiles is stored, up to three times, before it fails.

``--most-expensive N`` prints the N most expensive tests. ``--limit-costs`` fails if a test without
``@pytest.mark.costs("reason")`` is above ``LIMIT_S``. ``--write-costs FILE`` writes the CPU time of
each test file that needs a second or more; files that did not run keep their entry.
"""

import builtins
import json
import os
import re
import resource
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any, Final

import pytest

LIMIT_S: Final = 1.0
"""CPU time of a test on the reference machine that needs no reason."""
MARGIN: Final = 2.0
"""A test fails above ``MARGIN * LIMIT_S``: the cost differs between processors. On two cores that
eleven processes shared, twelve single measurements were 0.8 to 1.5 times the cost."""
TRIES: Final = 3
"""Measurements alone of a test above the limit, of which the smallest counts."""
REFERENCE_S: Final = 0.03
"""CPU time of ``calibration_s`` on the reference machine (2 cores of a cloud server, 2026)."""
_TICK_S: Final = 1.0 / os.sysconf("SC_CLK_TCK")
_REASONED: Final = ("nightly", "costs")


def descendants(pid: str) -> Iterator[str]:
    """Process IDs of the living descendants of a process (Linux; elsewhere none)."""
    try:  # a process may end at any time
        files = list(Path("/proc", pid, "task").glob("*/children"))
    except OSError:
        return
    for file in files:
        try:
            children = file.read_text().split()
        except OSError:
            continue
        for child in children:
            yield child
            yield from descendants(child)


def cpu_s() -> float:
    """Return the CPU time of this process and its descendants so far."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    total_s = time.process_time() + ended.ru_utime + ended.ru_stime
    for pid in descendants("self"):
        try:
            fields = Path("/proc", pid, "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        total_s += _TICK_S * sum(map(int, fields[11:15]))
    return total_s


def calibration_s() -> float:
    """Return the CPU time of a fixed piece of work, which tells the speed of this machine now."""
    start_s = time.process_time()
    table: dict[int, float] = {}
    for k in range(200_000):
        table[k % 1000] = table.get(k % 997, 0.0) + 0.5 * k
    return time.process_time() - start_s


def reason_of(item: pytest.Item, marker: str) -> str | None:
    """Return the reason that a marker states; an error says that it has none."""
    mark = item.get_closest_marker(marker)
    if mark is None:
        return None
    if len(mark.args) != 1 or not isinstance(mark.args[0], str) or not mark.args[0].strip():
        raise pytest.UsageError(f'{item.nodeid}: {marker} has no reason; write {marker}("reason")')
    return mark.args[0]


def measure_again(name: str) -> float:
    """Return the CPU time of a test that runs alone, on the reference machine."""
    words = [sys.executable, "-m", "pytest", name, "-n", "0", "--most-expensive", "1"]
    output = subprocess.run(words, capture_output=True, text=True, check=False).stdout
    line = re.search(rf"^ *([0-9.]+) s  {re.escape(name)}$", output, re.MULTILINE)
    slowdown = max(1.0, calibration_s() / REFERENCE_S)
    return float(line[1]) / slowdown if line is not None else float("inf")


class Meter:
    """Measures in the process that runs the tests. Each report carries its costs."""

    def __init__(self, clock: Callable[[], float] = cpu_s) -> None:
        self._cpu_s = clock
        self._last_s = 0.0
        self._test_s = 0.0
        self._apart_s: Counter[str] = Counter()
        self._inner_s = [0.0]
        self._import = builtins.__import__
        self._is_importing = False

    def pytest_runtest_logstart(self) -> None:
        self._last_s = self._cpu_s()
        self._test_s = 0.0
        builtins.__import__ = self._measured_import

    def pytest_runtest_logfinish(self) -> None:
        builtins.__import__ = self._import

    def _measured_import(self, *args: Any, **named: Any) -> Any:
        if self._is_importing:
            return self._import(*args, **named)
        self._is_importing = True
        start_s = time.process_time()
        try:
            return self._import(*args, **named)
        finally:
            self._is_importing = False
            self._count_apart("imports", time.process_time() - start_s)

    def _count_apart(self, name: str, spent_s: float, inner_s: float = 0.0) -> None:
        self._apart_s[name] += spent_s - inner_s
        self._inner_s[-1] += spent_s

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_fixture_setup(
        self, fixturedef: pytest.FixtureDef[Any], request: pytest.FixtureRequest
    ) -> Generator[None, Any, Any]:
        if fixturedef.scope == "function":
            return (yield)
        start_s = self._cpu_s()
        self._inner_s.append(0.0)
        try:
            return (yield)
        finally:
            inner_s = self._inner_s.pop()
            name = f"{request.node.nodeid}::{fixturedef.argname} ({fixturedef.scope} fixture)"
            self._count_apart(name, self._cpu_s() - start_s, inner_s)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Generator[None, Any, Any]:
        report = yield
        now_s = self._cpu_s()
        spent_s = now_s - self._last_s - self._apart_s.total()
        self._test_s += spent_s
        report.costs_s = {"test": spent_s, **self._apart_s}
        self._apart_s.clear()
        if report.when == "teardown" and self._test_s > LIMIT_S:
            report.slowdown = max(1.0, calibration_s() / REFERENCE_S)
            report.reason = reason_of(item, "costs") or reason_of(item, "nightly")
            now_s = self._cpu_s()
        self._last_s = now_s
        return report


class Table:
    """Collects the costs of all processes, prints and checks them."""

    def __init__(
        self, config: pytest.Config, again: Callable[[str], float] = measure_again
    ) -> None:
        self._again = again
        self._most: int = config.getoption("most_expensive")
        self._is_limited: bool = config.getoption("limit_costs")
        self._file: str | None = config.getoption("write_costs")
        self._tests_s: Counter[str] = Counter()
        self._shared_s: Counter[str] = Counter()
        self._over: dict[str, float] = {}

    def pytest_runtest_logreport(self, report: Any) -> None:
        costs_s = dict(getattr(report, "costs_s", {}))
        self._tests_s[report.nodeid] += costs_s.pop("test", 0.0)
        self._shared_s.update(costs_s)
        if getattr(report, "slowdown", None) is not None and report.reason is None:
            cost_s = self._tests_s[report.nodeid] / report.slowdown
            if cost_s > MARGIN * LIMIT_S:
                self._over[report.nodeid] = cost_s

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if self._is_limited and session.exitstatus == pytest.ExitCode.OK:
            for _ in range(TRIES):
                again_s = {name: min(s, self._again(name)) for name, s in self._over.items()}
                self._over = {name: s for name, s in again_s.items() if s > MARGIN * LIMIT_S}
        if self._is_limited and self._over and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED
        if self._file is not None:
            files_s: Counter[str] = Counter()
            for name, spent_s in (*self._tests_s.items(), *self._shared_s.items()):
                files_s[name.partition("::")[0]] += spent_s
            file = Path(self._file)
            known_s = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
            new_s = {name: round(s) for name, s in (known_s | files_s).items()}
            kept_s = {name: s for name, s in sorted(new_s.items()) if s >= 1 and "/" in name}
            file.write_text(json.dumps(kept_s, indent=1) + "\n", encoding="utf-8")

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        out = terminalreporter
        if self._most:
            total_s = self._tests_s.total() + self._shared_s.total()
            out.section(f"CPU time: {total_s:.0f} s, {len(self._tests_s)} tests")
            for name, spent_s in self._tests_s.most_common(self._most):
                out.line(f"{spent_s:7.2f} s  {name}")
            out.line("shared fixtures and imports:")
            for name, spent_s in self._shared_s.most_common(self._most // 3):
                out.line(f"{spent_s:7.2f} s  {name}")
        if self._is_limited and self._over:
            out.section("too expensive")
            for name, cost_s in self._over.items():
                out.line(
                    f"{name}: needs {cost_s:.1f} s of CPU, more than {LIMIT_S:g} s; make it "
                    'cheaper, mark it slow, or state a reason: @pytest.mark.costs("...")'
                )


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("costs", "CPU time of tests")
    group.addoption("--most-expensive", type=int, default=0, help="number of tests to list")
    group.addoption("--limit-costs", action="store_true", help="fail for a test above 1 s of CPU")
    group.addoption("--write-costs", help="JSON file for the CPU time of each test file")


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Meter())
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Table(config))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Reject markers without a reason."""
    for item in items:
        for marker in _REASONED:
            reason_of(item, marker)
