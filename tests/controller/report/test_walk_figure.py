"""The figure of a walk: which decision is drawn as what, and the scales of its panels."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgba
from numpy.typing import ArrayLike

from snakewalk.config.colours import BLUE
from snakewalk.controller.report.figures.walk import walk_figure
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.topics import WalkTable
from tests.helpers.legible_figures import figure_faults

STATES = [5, 5, 9, 5, 2, 2, 9]
VISITED = [1, 1, 2, 2, 3, 3, 3]
ERROR_RAD = 0.1 * np.arange(7)


def walk(states: ArrayLike = STATES, carrier_rad: ArrayLike = 0.0) -> WalkTable:
    state = np.asarray(states)
    count = len(state)
    return WalkTable(
        np.arange(float(count)),
        state,
        np.resize(VISITED, count),
        np.resize(ERROR_RAD, count),
        -np.resize(ERROR_RAD, count),
        np.arange(count) % 7 // 2,  # none for the first two of seven
        np.full(count, 0.7),
        np.broadcast_to(carrier_rad, count),
    )


def drawn(record: RunRecord, table: WalkTable) -> list[Axes]:
    figure = walk_figure(replace(record, walk=table))
    assert figure is not None
    for axes in figure.axes:
        assert all(line.get_linewidth() > 0.0 for line in axes.lines)
        assert axes.get_title() or not axes.get_legend(), "a panel has a title"
    return list(figure.axes)


def places(axes: Axes, label: str) -> list[list[float]]:
    (marks,) = (each for each in axes.collections if each.get_label() == label)
    assert isinstance(marks, PathCollection)
    return np.asarray(marks.get_offsets()).tolist()


def legend(axes: Axes) -> list[str]:
    shown = axes.get_legend()
    assert shown is not None
    return [text.get_text() for text in shown.get_texts()]


def test_decisions_start_a_state_continue_it_or_repeat_an_earlier_one(record: RunRecord) -> None:
    states, _, _ = drawn(record, walk())
    assert places(states, "started") == [[1, 5], [3, 9], [5, 2]]
    assert places(states, "continued") == [[2, 5], [6, 2]]
    assert places(states, "repeated") == [[4, 5], [7, 9]]
    assert legend(states) == ["started", "continued", "repeated"]
    assert states.lines[0].get_xydata().tolist() == [[k + 1, s] for k, s in enumerate(STATES)]


def test_axes_are_labelled_and_text_is_whole(record: RunRecord) -> None:
    figure = walk_figure(replace(record, walk=walk()))
    assert figure is not None
    assert figure_faults(figure) == []


def test_the_count_of_states_has_a_scale_of_its_own_in_its_colour(record: RunRecord) -> None:
    _, _, count = drawn(record, walk())
    (line,) = count.lines
    assert np.asarray(line.get_ydata()).tolist() == VISITED
    labels = [text.get_color() for text in count.get_yticklabels()]
    assert {to_rgba(colour) for colour in [line.get_color(), *labels]} == {to_rgba(BLUE)}
    assert count.get_ylim()[0] == 0.0
    ticks = count.get_yticks()
    assert ticks.tolist() == np.rint(ticks).tolist()
    assert len(ticks) <= 6


def test_the_aim_marks_decisions_without_a_fitting_shape(record: RunRecord) -> None:
    _, aim, _ = drawn(record, walk())
    assert places(aim, "no shape within the tolerance") == [[1, 0.0], [2, 0.1]]
    thin, *thick = (line.get_linewidth() for line in aim.lines)
    assert thin < thick[0] == thick[1], "error and bend alike, over a thinner 0"
    level, error, bend = (np.asarray(line.get_ydata()) for line in aim.lines)
    np.testing.assert_array_equal(level, [0.0, 0.0])
    np.testing.assert_array_equal(error, ERROR_RAD)
    np.testing.assert_array_equal(bend, -ERROR_RAD)
    assert aim.get_xlim() == (0.0, 8.0)
    ticks = aim.get_xticks()
    assert ticks.tolist() == np.rint(ticks).tolist()
    every = drawn(record, replace(walk(), candidates=np.ones(7, int)))
    assert not every[1].collections


@pytest.mark.parametrize("states", [[4] * 7, [4]])
def test_a_walk_of_one_state_shows_only_the_aim(record: RunRecord, states: list[int]) -> None:
    (aim,) = drawn(record, walk(states))
    assert legend(aim) == ["heading error of the shape", "bend added against it"]
    assert not aim.collections


def test_no_decision_draws_nothing_and_many_become_one_picture(record: RunRecord) -> None:
    assert walk_figure(replace(record, walk=walk([]))) is None
    for count, order in ((4000, None), (4001, 10)):
        panels = drawn(record, walk(np.arange(count) % 5))[:2]
        assert [axes.get_rasterization_zorder() for axes in panels] == [order, order]
        highest = max(part.get_zorder() for axes in panels for part in axes.collections)
        assert highest < 10, "all marks are below the order"


@pytest.mark.parametrize(("count", "size"), [(2, 26.0), (100, 18.0), (900, 6.0)])
def test_marks_are_smaller_in_a_longer_walk_within_limits(
    record: RunRecord, count: int, size: float
) -> None:
    states = drawn(record, walk(np.arange(count)))[0]
    (marks,) = (each for each in states.collections if each.get_label() == "started")
    assert isinstance(marks, PathCollection)
    assert marks.get_sizes().tolist() == [size]
