"""Cases beyond those that stay fast are slow; a case that has a tier already keeps it."""

from types import SimpleNamespace
from typing import Any

import pytest

from tests.tiers.cases import kept_indices, pytest_collection_modifyitems


class Item(SimpleNamespace):
    def get_closest_marker(self, name: str) -> pytest.Mark | None:
        return next((mark for mark in self.marks if mark.name == name), None)

    def add_marker(self, marker: pytest.MarkDecorator) -> None:
        self.marks.append(marker.mark)


def tiers_of(*marks: list[pytest.MarkDecorator]) -> list[str]:
    items: list[Any] = [
        Item(nodeid=f"test_x.py::test_y[{k}]", marks=[each.mark for each in case])
        for k, case in enumerate(marks)
    ]
    pytest_collection_modifyitems(items)
    tiers = ("nightly", "slow", "fast")
    return [
        next(t for t in tiers if t == "fast" or item.get_closest_marker(t) is not None)
        for item in items
    ]


@pytest.mark.parametrize("cases", range(1, 30))
@pytest.mark.parametrize("fast", [1, 2, 7])
def test_kept_cases_are_spread_and_the_first_is_among_them(cases: int, fast: int) -> None:
    kept = sorted(kept_indices(cases, fast))
    assert len(kept) == min(cases, fast)
    assert kept[0] == 0
    gaps = {after - before for before, after in zip(kept, [*kept[1:], cases], strict=True)}
    assert max(gaps) - min(gaps) <= 1


def test_other_cases_are_slow() -> None:
    fast = pytest.mark.fast_cases(2)
    assert tiers_of([fast], [fast], [fast], [fast]) == ["fast", "slow", "fast", "slow"]


def test_other_slow_cases_are_nightly() -> None:
    marks = [pytest.mark.fast_cases(1), pytest.mark.slow_cases(1, "a reason")]
    assert tiers_of(marks, marks, marks) == ["fast", "slow", "nightly"]
    slow = [pytest.mark.slow, pytest.mark.slow_cases(2, "a reason")]
    assert tiers_of(slow, slow, slow) == ["slow", "slow", "nightly"]


def test_a_case_with_a_tier_does_not_count() -> None:
    fast, slow = pytest.mark.fast_cases(1), pytest.mark.slow
    assert tiers_of([fast, slow], [fast], [fast]) == ["slow", "fast", "slow"]
    nightly = [slow, pytest.mark.nightly("a reason"), pytest.mark.slow_cases(1, "another")]
    assert tiers_of(nightly, [slow, nightly[2]]) == ["nightly", "slow"]
    assert tiers_of([], [], []) == ["fast", "fast", "fast"]


def test_a_case_that_is_selected_alone_stays_fast() -> None:
    assert tiers_of([pytest.mark.fast_cases(1)]) == ["fast"]
