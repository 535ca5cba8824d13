"""The bar of a run: nothing is left of one that failed before it began."""

from contextlib import suppress

import pytest

from snakewalk.controller.console.progress import (
    PathBar,
    ProgressBar,
    TimeBar,
    remaining_note,
    show_progress,
)
from snakewalk.controller.runtime.drive import Progress


@pytest.mark.parametrize(("cycles", "error"), [(12, None), (12, OSError("cut")), (0, None)])
def test_a_run_that_began_leaves_its_bar(
    cycles: int, error: OSError | None, capsys: pytest.CaptureFixture[str]
) -> None:
    _run(cycles, error)
    shown = capsys.readouterr().err
    assert ("waypoint 0/1" if cycles else "ramp") in shown


def test_a_run_that_fails_before_its_first_cycle_leaves_no_bar(
    capsys: pytest.CaptureFixture[str],
) -> None:
    _run(0, OSError("no port"))
    assert capsys.readouterr().err == ""


def test_the_bar_of_a_run_that_changes_its_gait_names_the_one_that_moves(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with TimeBar("rolling", 4.0, lambda gone_s: "rolling" if gone_s < 2.0 else "wheel") as bar:
        for time_s in (1.0, 3.5):
            bar.on_progress(Progress(time_s, 0.1, 0, 0.2, done=True))
    shown = capsys.readouterr().err
    assert "wheel" in shown
    assert "rolling" not in shown


def test_where_all_was_done_before_the_bar_is_full(capsys: pytest.CaptureFixture[str]) -> None:
    assert list(show_progress([], "trials", 3, done=3, transient=False)) == []
    assert "100%" in capsys.readouterr().err


def test_a_name_is_shown_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """Brackets and colons are no styles and no pictures."""
    name = "a[/b]:100:[red].csv"
    with ProgressBar(name, 1.0) as bar:
        bar.update(1.0, note=name)
    assert capsys.readouterr().err.count(name) == 2


def _run(cycles: int, error: OSError | None) -> None:
    with suppress(OSError), PathBar(2.0) as bar:
        for cycle in range(cycles):
            bar.on_progress(Progress(0.02 * cycle, 0.1, 0, 0.2, cycle == cycles - 1, waypoints=1))
        if error is not None:
            raise error


def test_a_caller_that_rejects_an_item_leaves_no_line(capsys: pytest.CaptureFixture[str]) -> None:
    with suppress(ValueError):
        for number in show_progress([1, 2], "recordings", 2):
            if number == 2:
                raise ValueError("no such recording")
    assert capsys.readouterr().err == ""


class SteppedClock:
    """A minute passes each time that somebody looks."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        self.time_s += 60.0
        return self.time_s

    def sleep_until_s(self, time_s: float) -> None:
        self.time_s = time_s


def test_the_remaining_time_counts_only_what_was_done_now(
    capsys: pytest.CaptureFixture[str],
) -> None:
    shown = show_progress(
        iter("ab"), "trials", 100_000, done=50_000, transient=False, clock=SteppedClock()
    )
    assert list(shown) == ["a", "b"]
    assert "about 34 d 17 h remain" in capsys.readouterr().err.replace("\n", " ")


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, ""),
        (89.0, "about 89 s remain"),
        (90.0, "about 2 min remain"),
        (5400.0, "about 1 h 30 min remain"),
        (2.0 * 86_400.0, "about 2 d 0 h remain"),
    ],
)
def test_a_remaining_time_has_two_units_at_most(seconds: float, text: str) -> None:
    assert remaining_note(seconds) == text
