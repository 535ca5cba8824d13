"""Second body for a robot on a port: in another process, or in simulated time for a rehearsal."""

import pickle
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.child_process import pipe, start
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.run.external.served_robot import physics_modules
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.walk.pilot import Pilot
from snakewalk.controller.walk.twin_answers import TwinAnswer, TwinQuestion
from snakewalk.controller.walk.twin_rollout import TwinRollout

PIECE_S = 0.22
"""Time of a piece in a rehearsal: median CPU time of 807 pieces on a busy machine; a tenth needed
less than 0.16 s (docs/benchmarks/rehearsal.md)."""
LARGEST_BYTES = 60_000
"""Largest question that a pipe accepts at once."""


class TwinTrial:
    """Tries the pieces of a question one after the other."""

    def __init__(self, run: RunConfig, robot: RobotConfig, world: WorldConfig) -> None:
        self._prepared = WalkRun(run, robot, world)

    @cached_property
    def _pilot(self) -> Pilot:
        prepared = self._prepared
        pilot = prepared.pilot()
        _, twins = physics_modules()
        twin = twins.PlantTwin(prepared.robot, prepared.world, prepared.ground)
        pilot.use_twin(TwinRollout(prepared.robot, lambda: twin, prepared.world.friction))
        return pilot

    def prepare(self) -> None:
        """Make the pilot and its twin within seconds."""
        assert self._pilot.twin is not None

    def answers(self, question: TwinQuestion) -> Iterator[TwinAnswer]:
        """Yield each answer as soon as it is known."""
        pilot = self._pilot
        robot = self._prepared.robot
        twin = pilot.twin
        assert twin is not None
        twin.friction = question.friction
        twin.forget()
        for pose, joint_rad in question.bodies:
            twin.observe(body_in_world(robot, pose, joint_rad), question.cycle_s)
        for piece, piece_rad in enumerate(question.pieces_rad):
            try:
                rolled = pilot.tried_from(question.coasting, question.pose, piece_rad)
            except RuntimeError:  # it has diverged
                yield TwinAnswer(question.number, piece, None)
            else:
                yield TwinAnswer(question.number, piece, rolled.columns)


class RehearsedTwin:
    """A ``TwinAnswers`` in simulated time: a reply needs ``PIECE_S``."""

    def __init__(self, trial: TwinTrial, now_s: Callable[[], float]) -> None:
        self._trial = trial
        self._now_s = now_s
        self._pieces: Iterator[TwinAnswer] = iter(())
        self._due_s = 0.0

    def ask(self, question: TwinQuestion) -> None:
        """Ask; the present piece is completed first."""
        now_s = self._now_s()
        begin_s = max(now_s, min(self._due_s, now_s + PIECE_S))
        self._pieces = self._trial.answers(question)
        self._due_s = begin_s + PIECE_S

    def arrived(self) -> Sequence[TwinAnswer]:
        """Return the answers that are due."""
        answers = list[TwinAnswer]()
        while self._due_s <= self._now_s():
            answer = next(self._pieces, None)
            if answer is None:
                break
            answers.append(answer)
            self._due_s += PIECE_S
        return answers

    def close(self) -> None:
        """Do nothing; only a worker has a process to end."""


class ProcessTwin:
    """A ``TwinAnswers`` in a worker process; use ``close``."""

    def __init__(self, run: RunConfig, robot: RobotConfig, world: WorldConfig) -> None:
        self._line, other = pipe()
        self._process: SpawnProcess = start(_serve, other, run, robot, world, daemon=True)
        other.close()
        self._listens = False
        self._kept = list[TwinAnswer]()

    def ask(self, question: TwinQuestion) -> None:
        """Ask if the worker has begun the previous question."""
        self._kept = self._receive()
        data = pickle.dumps(question)
        if self._listens and len(data) <= LARGEST_BYTES:
            self._listens = False
            try:
                self._line.send_bytes(data)
            except OSError:  # it has ended
                return

    def arrived(self) -> Sequence[TwinAnswer]:
        """Return the answers that have arrived."""
        return self._receive()

    def _receive(self) -> list[TwinAnswer]:
        kept = self._kept
        self._kept = []
        try:
            while self._line.poll():
                message = self._line.recv()
                if message is None:
                    self._listens = True
                else:
                    kept.append(message)
        except (EOFError, OSError):  # it has ended
            self._listens = False
        return kept

    def close(self) -> None:
        """End the worker."""
        self._line.close()
        self._process.terminate()
        self._process.join()


def _serve(line: Connection, run: RunConfig, robot: RobotConfig, world: WorldConfig) -> None:
    """Reply to questions until the line is closed; None reports readiness."""
    trial = TwinTrial(run, robot, world)
    trial.prepare()
    try:
        line.send(None)
        while True:
            question = pickle.loads(line.recv_bytes())
            line.send(None)
            for answer in trial.answers(question):
                line.send(answer)
                if line.poll():  # another question
                    break
    except (EOFError, OSError):
        return
