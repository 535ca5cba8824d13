"""The friction monitor: a body that slides by a friction tells of it."""

import numpy as np
import pytest

from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.mechanics import rigid_motion
from snakewalk.controller.mechanics.friction_filter import FoundFriction, FrictionFilter
from snakewalk.controller.runtime.friction_monitor import (
    SPAN_S,
    FrictionMonitor,
    OnPaper,
    OnTwin,
    Span,
)
from snakewalk.controller.walk.twin import seen_state
from snakewalk.drivers.types import BodyPose
from tests.helpers.sliding_body import CYCLE_S, FILE, ROBOT, joints_rad, posed, sliding

CYCLES = round(SPAN_S / CYCLE_S)


def watched(friction: FrictionConfig) -> tuple[list[FoundFriction], list[FrictionConfig]]:
    """What is found of 30 s, and what is to be reckoned with."""
    used: list[FrictionConfig] = []
    monitor = FrictionMonitor(FILE, OnPaper(), CYCLE_S, used.append)
    assert not monitor.confirms_file  # before a span is judged
    told = [monitor.update(view, joints_rad(0.0)) for view in sliding(friction, 30.0)]
    assert monitor.confirms_file == (not used)
    return [found for found in told if found is not None], used


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("factors", [(1.5, 0.8), (1.0, 0.5), (1.5, 1.5)])
def test_the_friction_that_a_body_slides_by_is_found(factors: tuple[float, float]) -> None:
    """On a level floor motion tells the ratio; each friction lies within its wide interval."""
    planted = FrictionConfig(along=0.1 * factors[0], across=0.7 * factors[1])
    found, used = watched(planted)
    last = found[-1]
    assert last.along_95[0] < planted.along < last.along_95[1]
    assert last.across_95[0] < planted.across < last.across_95[1]
    ratio = planted.across / planted.along
    assert last.friction.across / last.friction.along == pytest.approx(ratio, rel=0.1)
    assert used[-1:] == ([last.friction] if last.differs else [])
    assert last.differs == (factors[0] != factors[1])


@pytest.mark.slow
def test_a_body_as_the_file_says_leaves_the_file_in_force() -> None:
    found, used = watched(FILE)
    assert used == []
    assert 6 <= len(found) <= 8  # four in a row, and then one in four
    assert found[-1].friction.along == pytest.approx(0.1, rel=0.03)


@pytest.mark.slow
def test_a_change_of_ground_is_found_though_it_had_settled() -> None:
    other, used = FrictionConfig(along=0.15, across=0.5), list[FrictionConfig]()
    monitor = FrictionMonitor(FILE, OnPaper(), CYCLE_S, used.append)
    for view in sliding(FILE, 50.0, later=other):
        monitor.update(view, joints_rad(0.0))
    assert used
    assert used[-1].across / used[-1].along == pytest.approx(0.5 / 0.15, rel=0.2)


def test_the_slide_of_shapes_is_that_of_single_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A body slides as it did when it was made, compiled or not, but for longer steps."""
    views = sliding(FILE, 1.0)
    span = Span(tuple(views), (), CYCLE_S)
    predicted = OnPaper().slid(span, FILE)
    np.testing.assert_allclose(predicted, span.slid, atol=6e-3)
    for name, each in vars(rigid_motion).items():
        if hasattr(each, "py_func"):
            monkeypatch.setattr(rigid_motion, name, each.py_func)
    np.testing.assert_array_equal(OnPaper().slid(span, FILE), predicted)


class Notes:
    """A model that notes what it is asked, and does not know."""

    sigma = np.array([0.01, 0.01, 0.03])

    def __init__(self) -> None:
        self.asked: list[tuple[Span, FrictionConfig]] = []

    def slid(self, span: Span, friction: FrictionConfig) -> np.ndarray:
        self.asked.append((span, friction))
        return np.full(3, np.nan)


def test_a_span_is_replayed_with_the_goals_of_its_cycles_one_friction_a_cycle() -> None:
    """Goals of cycle k bring it from view k to view k + 1; no cycle is left out between spans."""
    notes = Notes()
    monitor = FrictionMonitor(FILE, notes, CYCLE_S, lambda friction: None)
    views = [posed(np.zeros(ROBOT.joint_count), 0.0, np.array([k, 0.0])) for k in range(250)]
    counts = []
    for k, view in enumerate(views):
        monitor.update(view, np.full(ROBOT.joint_count, k - 1.0))
        counts.append(len(notes.asked))
    assert max(np.diff(counts)) == 1
    spans = [span for span, _ in notes.asked[::3]]
    begins = []
    for span in spans:
        x_m = [view.centre_m[0] for view in span.views]
        at = [round(x - views[0].centre_m[0]) for x in x_m]
        assert at == list(range(at[0], at[0] + CYCLES + 2))
        assert [goal[0] for goal in span.goals_rad] == at[1:-1]
        begins.append(at[1])
    assert begins == [1, 1 + CYCLES, 1 + 2 * CYCLES]
    assert notes.asked[0][1] == FILE


def test_what_cannot_be_foretold_changes_nothing() -> None:
    used: list[FrictionConfig] = []
    monitor = FrictionMonitor(FILE, Notes(), CYCLE_S, used.append)
    for view in sliding(FrictionConfig(along=0.3, across=0.5), 5.0):
        monitor.update(view, joints_rad(0.0))
        assert monitor.event_text() is None
    assert used == []
    assert not monitor.confirms_file, "motion without a prediction confirms nothing"
    assert monitor.alarm_text.startswith("friction not estimated")


class Foretells(Notes):
    """A model of ground that is 3 % above the file's friction."""

    def slid(self, span: Span, friction: FrictionConfig) -> np.ndarray:
        super().slid(span, friction)
        logs = np.log([friction.along / FILE.along, friction.across / FILE.across]) - 0.03
        return np.asarray(span.slid + np.array([[0.3, 0.1], [0.2, -0.3], [0.0, 0.4]]) @ logs)


def test_after_four_confirmed_spans_one_in_four_is_replayed_as_the_news_of_all_four() -> None:
    model = Foretells()
    monitor = FrictionMonitor(FILE, model, CYCLE_S, lambda friction: None)
    view = posed(joints_rad(0.0), 0.3, np.array([1.0, 2.0]))
    told = [monitor.update(view, joints_rad(0.0)) for _ in range(12 * CYCLES + 5)]
    found = {k: each for k, each in enumerate(told) if each is not None}
    assert list(found) == [CYCLES * span + 4 for span in (1, 2, 3, 4, 8, 12)]
    of_spans = FrictionFilter(FILE, model.sigma.tolist())
    for each, count in zip(found.values(), (1, 1, 1, 1, 4, 4), strict=True):
        span = model.asked[0][0]
        predicted = [model.slid(span, friction) for friction in of_spans.hypotheses()]
        assert each == of_spans.update(span.slid, np.array(predicted), count * SPAN_S)


def test_a_slide_is_seen_from_the_mean_heading_at_its_begin() -> None:
    """From (2, -1) and 0.5 rad 0.3 m ahead, 0.1 m to the left and 0.2 rad to the left."""
    ahead, left = np.array([np.cos(0.5), np.sin(0.5)]), np.array([-np.sin(0.5), np.cos(0.5)])
    begin_m = np.array([2.0, -1.0])
    places = (begin_m + 7.0, 2.1), (begin_m, 0.5), (begin_m + 0.3 * ahead + 0.1 * left, 0.7)
    views = tuple(posed(joints_rad(0.0), heading, centre_m) for centre_m, heading in places)
    np.testing.assert_allclose(Span(views, (), CYCLE_S).slid, [0.3, 0.1, 0.2], atol=1e-9)


class Replays:
    """A twin that moves as the views; without them it diverges."""

    def __init__(self, views: tuple[BodyView, ...] = ()) -> None:
        self.states = iter([seen_state(ROBOT, view) for view in views])
        self.asked: list[object] = []

    def use_friction(self, friction: FrictionConfig) -> None:
        self.asked.append(friction)

    def begin(
        self,
        before: BodyPose,
        now: BodyPose,
        before_rad: np.ndarray,
        now_rad: np.ndarray,
        dt_s: float,
    ) -> None:
        for pose, angles in ((before, before_rad), (now, now_rad)):
            seen, seen_rad = next(self.states, (pose, angles))
            np.testing.assert_array_equal(pose.head_in_world_m, seen.head_in_world_m)
            np.testing.assert_array_equal(angles, seen_rad)

    def step(self, goal_rad: np.ndarray, dt_s: float) -> tuple[BodyPose, np.ndarray]:
        self.asked.append(goal_rad[0])
        for state in self.states:
            return state
        raise RuntimeError("the physics diverged")


def test_a_twin_that_diverges_tells_nothing_and_another_where_it_came_to() -> None:
    views = tuple(sliding(FILE, 0.1))
    span = Span(views, tuple(np.full(ROBOT.joint_count, k) for k in range(4)), CYCLE_S)
    assert np.isnan(OnTwin(ROBOT, Replays).slid(span, FILE)).all()
    twin = Replays(views)
    np.testing.assert_allclose(OnTwin(ROBOT, lambda: twin).slid(span, FILE), span.slid, atol=1e-9)
    assert twin.asked == [FILE, 0.0, 1.0, 2.0, 3.0]


def test_news_are_notable_changes_in_words() -> None:
    used: list[FrictionConfig] = []
    monitor = FrictionMonitor(FILE, OnPaper(), CYCLE_S, used.append)
    lines = []
    for view in sliding(FrictionConfig(along=0.2, across=0.7), 20.0):
        monitor.update(view, joints_rad(0.0))
        lines += [line for line in [monitor.event_text()] if line is not None]
    assert 1 <= len(lines) <= 3
    assert lines[0].startswith("found 0.1")
    assert lines[0].endswith("the world's file has 0.1 and 0.7")


def test_an_alarm_states_the_estimate_and_excludes_no_ground() -> None:
    monitor = FrictionMonitor(FILE, OnPaper(), CYCLE_S, lambda _: None)
    for view in sliding(FILE, 10.0):
        monitor.update(view, joints_rad(0.0))
    assert monitor.confirms_file
    text = monitor.alarm_text
    assert "0.1 along and 0.7 across, law ellipse (assumed)" in text
    assert "the ground is not excluded" in text
    assert "it is not the ground" not in text
