"""CPU time is measured with that of children; only a test without a reason exceeds the limit."""

import json
import subprocess
import sys
from collections.abc import Iterable
from itertools import chain, repeat
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.tiers.costs import (
    LIMIT_S,
    MARGIN,
    TRIES,
    Meter,
    Table,
    cpu_s,
    measure_again,
    reason_of,
)

BURN = "import time\nwhile time.process_time() < 0.1: pass"


def item(*marks: pytest.Mark) -> Any:
    named = {mark.name: mark for mark in marks}
    return SimpleNamespace(nodeid="tests/test_x.py::test_y", get_closest_marker=named.get)


def table(file: Path | None = None, again_s: Iterable[float] = ()) -> Table:
    """A table that measures again the costs of ``again_s``, and twice the limit after them."""
    again = chain(again_s, repeat(2.0 * MARGIN * LIMIT_S))
    options = {"most_expensive": 3, "limit_costs": True, "write_costs": file and str(file)}
    config: Any = SimpleNamespace(getoption=options.__getitem__)
    return Table(config, again=lambda name: next(again))


def report(cost_s: float, **more: object) -> Any:
    return SimpleNamespace(nodeid="tests/test_x.py::test_y", costs_s={"test": cost_s}, **more)


def exit_status(costs: Table) -> int:
    session: Any = SimpleNamespace(exitstatus=pytest.ExitCode.OK)
    costs.pytest_sessionfinish(session)
    return int(session.exitstatus)


def test_a_child_counts_while_it_lives_and_after_its_end() -> None:
    start_s = cpu_s()
    words = [sys.executable, "-S", "-c", f"{BURN}\nprint(flush=True)\ninput()"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        child.stdout.readline()
        assert cpu_s() - start_s > 0.08
        child.communicate(b"\n")
    assert cpu_s() - start_s > 0.08


def test_a_shared_fixture_is_counted_apart() -> None:
    meter = Meter(clock=iter([0.0, 1.0, 6.0, 8.0]).__next__)
    meter.pytest_runtest_logstart()
    meter.pytest_runtest_logfinish()
    request: Any = SimpleNamespace(node=SimpleNamespace(nodeid="tests/test_x.py"))
    fixture: Any = SimpleNamespace(scope="module", argname="film")
    for hook in (
        meter.pytest_fixture_setup(fixture, request),
        meter.pytest_runtest_makereport(item()),
    ):
        next(hook)
        with pytest.raises(StopIteration) as ended:
            hook.send(SimpleNamespace(when="call"))
    costs_s = ended.value.value.costs_s
    assert costs_s == {"test": 3.0, "tests/test_x.py::film (module fixture)": 5.0}


def test_only_a_test_clearly_above_the_limit_fails_and_only_without_a_reason() -> None:
    over_s = 1.1 * MARGIN * LIMIT_S
    for cost_s, reason, slowdown, expected in (
        (over_s, None, 1.0, 1),
        (over_s, "a film at full size", 1.0, 0),
        (0.9 * MARGIN * LIMIT_S, None, 1.0, 0),
        (over_s, None, 1.3, 0),  # a slow machine
    ):
        costs = table()
        costs.pytest_runtest_logreport(report(cost_s, reason=reason, slowdown=slowdown))
        assert exit_status(costs) == expected


@pytest.mark.parametrize("tries", range(1, TRIES + 1))
def test_a_test_fails_only_if_it_is_expensive_each_time(tries: int) -> None:
    """A loop was compiled, or the machine was busy."""
    costs = table(again_s=[*[2.0 * MARGIN * LIMIT_S] * (tries - 1), 0.1])
    costs.pytest_runtest_logreport(report(2.0 * MARGIN * LIMIT_S, reason=None, slowdown=1.0))
    assert exit_status(costs) == 0


@pytest.mark.slow
def test_a_test_is_measured_again_alone() -> None:
    burning = "tests/tiers/test_costs.py::test_a_child_counts_while_it_lives_and_after_its_end"
    assert 0.05 < measure_again(burning) < 3.0
    assert measure_again("tests/tiers/test_costs.py::test_of_no_name") == float("inf")


@pytest.mark.parametrize(("costs_s", "expected_s"), [((0.6, 1.7), 2), ((0.2, 0.1), None)])
def test_costs_are_written_and_those_of_other_files_kept(
    costs_s: tuple[float, ...], expected_s: int | None, tmp_path: Path
) -> None:
    file = tmp_path / "cpu_s.json"
    file.write_text('{"tests/test_x.py": 7, "tests/test_z.py": 3}')
    costs = table(file)
    for cost_s in costs_s:
        costs.pytest_runtest_logreport(report(cost_s))
    exit_status(costs)
    written_s = json.loads(file.read_text())
    assert written_s.pop("tests/test_z.py") == 3
    assert written_s == ({} if expected_s is None else {"tests/test_x.py": expected_s})


@pytest.mark.parametrize("arguments", [(), ("",), (3,)])
def test_a_marker_without_a_reason_is_rejected(arguments: tuple[object, ...]) -> None:
    marked = item(pytest.mark.nightly(*arguments).mark)
    with pytest.raises(pytest.UsageError, match="nightly has no reason"):
        reason_of(marked, "nightly")


def test_a_reason_is_read() -> None:
    assert reason_of(item(pytest.mark.costs("a film").mark), "costs") == "a film"
    assert reason_of(item(), "costs") is None
