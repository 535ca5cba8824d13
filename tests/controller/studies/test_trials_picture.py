"""The picture of trials: a cell a case, with its share as colour and its causes as text."""

from pathlib import Path

import pytest

pytest.importorskip("matplotlib")

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from snakewalk.controller.studies.plots import trials as plots
from snakewalk.controller.studies.trials import Case, Trial, table

SLOPES, FRICTIONS = (5, 10, 15), (0.3, 0.7)


def figure_of(monkeypatch: pytest.MonkeyPatch, cases: list[Case], found: list[Trial]) -> Figure:
    kept: list[Figure] = []
    monkeypatch.setattr(plots, "save_picture", lambda figure, *_, **__: kept.append(figure))
    plots.draw_trials(table(found, cases), Path("trials.png"))
    return kept[0]


def test_a_cell_a_case(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = [
        Case("ramp-10-up", motion, keys=(("world.ground.slope_deg", s), ("run.x", f)))
        for motion in ("walk", "serpenoid")
        for s in SLOPES
        for f in FRICTIONS
    ]
    found = [Trial(case, seed, complete=True) for case in cases[:-1] for seed in range(4)]
    found += [Trial(cases[-1], k, cause=c) for k, c in enumerate(("climb", "slip", "climb"))]
    figure = figure_of(monkeypatch, cases, found)
    walk, serpenoid = figure.axes
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["walk", "serpenoid"]
    for axes in figure.axes:
        assert sum(isinstance(patch, Rectangle) for patch in axes.patches) == 6
        assert [t.get_text() for t in axes.get_xticklabels()] == ["5", "10", "15"]
        assert [t.get_text() for t in axes.get_yticklabels()] == ["0.3", "0.7"]
    assert {text.get_text() for text in walk.texts} == {"4 of 4", ""}
    words = [text.get_text() for text in serpenoid.texts]
    assert words[-2:] == ["0 of 3", "2 climb\n1 slip"]
    assert {text.get_color() for text in (*walk.texts, *serpenoid.texts[-2:])} == {"white"}
    best, worst = serpenoid.patches[0], serpenoid.patches[-1]
    assert best.get_facecolor() == plots._SHARE(1.0)
    assert worst.get_facecolor() == plots._SHARE(0.0)
    assert worst.get_xy() == pytest.approx((1.52, 0.52))  # the last slope and friction


def test_a_cell_accounts_for_every_run(monkeypatch: pytest.MonkeyPatch) -> None:
    case = Case("ramp-10-up", "walk")
    causes = ("climb", "climb", "climb", "slip", "slip", "roll", "joint", "time")
    trials = [Trial(case, k, cause=cause) for k, cause in enumerate(causes)]
    figure = figure_of(monkeypatch, [case], [*trials, Trial(case, 9, complete=True)])
    (axes,) = figure.axes
    assert figure.get_suptitle() == "complete runs\nrelief 1\nmotion walk\nrun ramp-10-up"
    assert [text.get_text() for text in axes.texts] == ["1 of 9", "3 climb\n2 slip\n3 other"]


def test_worlds_are_an_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = [Case("flat-square", "walk", world=world) for world in ("flat", "ramp-10")]
    (axes,) = figure_of(monkeypatch, cases, []).axes
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["flat", "ramp-10"]


@pytest.mark.parametrize("relief", [(1.0,), (1.0, 2.0)])
def test_one_axis_or_none_is_drawn_as_well(
    monkeypatch: pytest.MonkeyPatch, relief: tuple[float, ...]
) -> None:
    cases = [Case("ramp-10-up", "walk", relief=factor) for factor in relief]
    figure = figure_of(monkeypatch, cases, [Trial(cases[0], 0, complete=True)])
    (axes,) = figure.axes
    assert len(axes.patches) == len(relief)
