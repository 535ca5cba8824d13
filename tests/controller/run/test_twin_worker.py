"""A second body beside a port: the same answers as in this process, in time or not at all."""

import copy
import pickle
from collections.abc import Iterator, Sequence
from contextlib import ExitStack

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.run.external.second_body import use_worker
from snakewalk.controller.run.external.twin_worker import (
    LARGEST_BYTES,
    PIECE_S,
    ProcessTwin,
    RehearsedTwin,
    TwinTrial,
)
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.walk.pilot import Pilot
from snakewalk.controller.walk.predictive_walker import PredictiveWalker
from snakewalk.controller.walk.twin_answers import Coasting, TwinAnswer, TwinAsker, TwinQuestion
from snakewalk.sim.physics.plant import MujocoPlant

pytest.importorskip("mujoco")
STEP_S = 0.02


@pytest.fixture(scope="module")
def prepared() -> WalkRun:
    found = prepare_job("ramp-15-up")
    assert isinstance(found, WalkRun)
    return found


class Asked:
    """Keeps the questions, and answers as it is told."""

    def __init__(self) -> None:
        self.questions: list[TwinQuestion] = []
        self.due: list[TwinAnswer] = []

    def ask(self, question: TwinQuestion) -> None:
        self.questions.append(question)

    def arrived(self) -> Sequence[TwinAnswer]:
        found, self.due = self.due, []
        return found


def climbing(prepared: WalkRun, answers: object) -> tuple[Pilot, BodyView]:
    """A pilot on the ramp that has asked, and its body, which does not move."""
    pilot, robot = prepared.pilot(), prepared.robot
    pilot.use_asker(TwinAsker(robot, answers, prepared.world.friction))  # type: ignore[arg-type]
    initial = prepared.initial_pose()
    plant = MujocoPlant(robot, prepared.world, prepared.ground)
    plant.reset((-0.6, 0.0), initial.heading_rad, initial.joint_rad)
    view = body_in_world(robot, plant.head_pose(), initial.joint_rad)
    pilot.begin(view)
    return pilot, view


@pytest.fixture(scope="module")
def question(prepared: WalkRun) -> TwinQuestion:
    asked = Asked()
    pilot, view = climbing(prepared, asked)
    for _ in range(400):
        pilot.step(STEP_S, view)
        if len(asked.questions) > 1:
            break
    return asked.questions[-1]


def test_a_trial_elsewhere_gives_the_result_of_the_pilot_itself(
    prepared: WalkRun, trial: TwinTrial, question: TwinQuestion
) -> None:
    asked = Asked()
    pilot, view = climbing(prepared, asked)
    states = list[Coasting]()
    ask = pilot._chooser.ask  # type: ignore[attr-defined]

    def kept(*question: object) -> None:
        whole = Coasting(pilot._time_law, pilot._roll, pilot._pitch_rad)
        states.append(copy.deepcopy(whole))
        ask(*question)

    pilot._chooser.ask = kept  # type: ignore[attr-defined]
    while len(asked.questions) < question.number:
        pilot.step(STEP_S, view)
    assert len(pickle.dumps(question)) < LARGEST_BYTES
    twin = trial._pilot.twin
    assert twin is not None
    pilot.use_twin(twin)
    twin.forget()
    for pose, joint_rad in question.bodies:
        twin.observe(body_in_world(prepared.robot, pose, joint_rad), question.cycle_s)
    expected = pilot.tried_from(states[-1], question.pose, question.pieces_rad[0])
    answer = next(trial.answers(question))
    assert (answer.number, answer.piece) == (question.number, 0)
    assert answer.columns is not None
    np.testing.assert_allclose(answer.columns, expected.columns, rtol=1e-6, atol=1e-6)


@pytest.fixture(scope="module")
def trial(prepared: WalkRun) -> TwinTrial:
    found = TwinTrial(prepared.run, prepared.robot, prepared.world)
    found.prepare()
    return found


class Counted:
    """A trial that takes no time."""

    def answers(self, question: TwinQuestion) -> Iterator[TwinAnswer]:
        for piece in range(len(question.pieces_rad)):
            yield TwinAnswer(question.number, piece, np.zeros((1, 10)))


def test_in_a_rehearsal_each_piece_takes_its_time_and_a_new_question_ends_the_old(
    question: TwinQuestion,
) -> None:
    now_s = 1.0
    twin = RehearsedTwin(Counted(), lambda: now_s)  # type: ignore[arg-type]
    twin.ask(question)
    assert twin.arrived() == []
    now_s += 2.5 * PIECE_S
    assert [answer.piece for answer in twin.arrived()] == [0, 1]
    newer = TwinQuestion(
        question.number + 1, question.bodies, question.cycle_s, question.friction, question.pose,
        question.coasting, question.pieces_rad,
    )  # fmt: skip
    twin.ask(newer)
    now_s += 1.4 * PIECE_S  # half a piece of the old question was under way
    assert twin.arrived() == []
    now_s += 0.2 * PIECE_S
    assert [(answer.number, answer.piece) for answer in twin.arrived()] == [(newer.number, 0)]


def rolled(cost_m: float) -> Floats:
    """Columns of a body that ends off its path by about the root of a cost."""
    columns = np.zeros((1, 10))
    columns[0, 3:] = cost_m
    return columns


def test_an_answer_counts_for_the_decision_it_was_asked_for_and_not_later(
    prepared: WalkRun,
) -> None:
    asked = Asked()
    pilot, view = climbing(prepared, asked)
    walker = pilot._chooser
    assert isinstance(walker, PredictiveWalker)
    made = list[int]()
    while len(made) < 3:
        pilot.step(STEP_S, view)
        if pilot.decision is not None:
            made.append(len(asked.questions))
            # an answer about the decision just made is late
            asked.due = [TwinAnswer(made[-1], 0, rolled(9.0))]
            assert walker._best_answer(walker._best_piece()).cost_m2 < 9.0
    assert made == sorted(made)
    assert made[-1] >= 2


@pytest.mark.slow
def test_a_worker_process_answers_and_ends(
    prepared: WalkRun, trial: TwinTrial, question: TwinQuestion
) -> None:
    twin = ProcessTwin(prepared.run, prepared.robot, prepared.world)
    try:
        assert twin.arrived() == []  # it starts, and nothing waits for it
        twin.ask(question)
        assert twin._line.poll(60.0)
        assert twin.arrived() == []
        twin.ask(question)
        found = list[TwinAnswer]()
        while not found:
            assert twin._line.poll(60.0)
            found = list(twin.arrived())
    finally:
        twin.close()
    expected = next(trial.answers(question))
    assert found[0].columns is not None
    np.testing.assert_array_equal(found[0].columns, expected.columns)
    assert not twin._process.is_alive()
    assert twin.arrived() == []
    twin.ask(question)  # without a worker nothing happens


def test_only_a_walk_on_hills_has_a_worker(prepared: WalkRun) -> None:
    with ExitStack() as until:
        floor = prepare_job("flat-slalom")
        source = floor.make_source(lambda kind, text: None)
        use_worker(floor, source, lambda: 0.0, until)
        assert source._asker is None  # type: ignore[attr-defined]
        source = prepared.make_source(lambda kind, text: None)
        use_worker(prepared, source, lambda: 0.0, until)
        assert source._asker is not None  # type: ignore[attr-defined]
