"""A plugin of pytest that chooses the tiers of the cases of a parametrized test.

``@pytest.mark.fast_cases(n)`` keeps ``n`` cases in the fast tier; the others become slow.
``@pytest.mark.slow_cases(n, "reason")`` keeps ``n`` of the slow cases; the others become nightly.

The cases that stay are spread evenly over the order of the cases, and the first is among them. A
case that is selected alone, by its name, stays where it is.
"""

from collections import defaultdict

import pytest


def kept_indices(cases: int, count: int) -> set[int]:
    """Return the indices of the cases that stay."""
    count = min(cases, count)
    return {k * cases // count for k in range(count)}


def _is(item: pytest.Item, *tiers: str) -> bool:
    return any(item.get_closest_marker(tier) is not None for tier in tiers)


def _move(items: list[pytest.Item], marker: str) -> None:
    tests: defaultdict[str, list[pytest.Item]] = defaultdict(list)
    for item in items:
        if item.get_closest_marker(marker) is not None:
            tests[item.nodeid.partition("[")[0]].append(item)
    for cases in tests.values():
        mark = cases[0].get_closest_marker(marker)
        assert mark is not None
        count, *reason = mark.args
        kept = kept_indices(len(cases), count)
        tier = pytest.mark.nightly(*reason) if reason else pytest.mark.slow
        for index, item in enumerate(cases):
            if index not in kept:
                item.add_marker(tier)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the other cases before pytest selects by markers."""
    _move([item for item in items if not _is(item, "slow", "nightly")], "fast_cases")
    _move([item for item in items if _is(item, "slow") and not _is(item, "nightly")], "slow_cases")
