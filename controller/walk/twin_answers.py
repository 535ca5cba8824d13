"""Pieces of track tried on a twin in another process; answers may come late or never."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.roll_compensation import RollCompensation
from snakewalk.controller.mechanics.rollout import Rolled
from snakewalk.controller.walk.steering import PathPose
from snakewalk.controller.walk.time_law import TimeLaw
from snakewalk.controller.walk.twin import seen_state
from snakewalk.drivers.types import BodyPose


@dataclass(frozen=True, slots=True)
class Coasting:
    """State of a pilot that continues without decisions; plain data for another process."""

    time_law: TimeLaw
    """Time law of the track, with its end."""
    roll: RollCompensation | None
    pitch_rad: Floats | None


@dataclass(frozen=True, slots=True)
class TwinQuestion:
    """Pieces of track to try on a twin, in order."""

    number: int
    bodies: tuple[tuple[BodyPose, Floats], ...]
    """Pose and joints (J,) of the robot in the last two cycles."""
    cycle_s: float
    friction: FrictionConfig
    pose: PathPose
    coasting: Coasting
    pieces_rad: tuple[Floats, ...]
    """(n,) each."""


@dataclass(frozen=True, slots=True)
class TwinAnswer:
    """Result for one piece."""

    number: int
    """Number of the question."""
    piece: int
    columns: Floats | None
    """(1, 10) of ``Rolled``; None if the twin diverged."""


class TwinAnswers(Protocol):
    """A twin that answers questions; neither method blocks."""

    def ask(self, question: TwinQuestion) -> None:
        """Ask, and drop the previous question."""
        ...

    def arrived(self) -> Sequence[TwinAnswer]:
        """Return the answers since the last call."""
        ...


class TwinAsker:
    """Asks about one robot, and stores the results of the last question."""

    def __init__(self, robot: RobotConfig, answers: TwinAnswers, friction: FrictionConfig) -> None:
        self._robot = robot
        self._answers = answers
        self.friction = friction
        """Friction of the ground that the twin is laid on."""
        self._seen: list[BodyView] = []
        self._cycle_s = 0.0
        self._number = 0
        self._results: dict[int, Rolled | None] = {}

    def observe(self, view: BodyView, dt_s: float) -> None:
        """Store the measured body, ``dt_s`` after the last."""
        self._seen = [*self._seen[-1:], view]
        self._cycle_s = dt_s

    def forget(self) -> None:
        """Discard bodies and results, because the robot did not follow its track."""
        self._seen = []
        self._results = {}

    def ask(self, pose: PathPose, coasting: Coasting, pieces_rad: Sequence[Floats]) -> None:
        """Ask about pieces (n,) of track, from the robot's last two bodies."""
        self._number = self._number + 1
        self._results = {}
        bodies = tuple(seen_state(self._robot, view) for view in self._seen)
        if len(bodies) == 2:
            self._answers.ask(
                TwinQuestion(
                    self._number,
                    bodies,
                    self._cycle_s,
                    self.friction,
                    pose,
                    coasting,
                    tuple(pieces_rad),
                )
            )

    def results(self) -> dict[int, Rolled | None]:
        """Return the results of the last question so far, by piece number."""
        for answer in self._answers.arrived():
            if answer.number == self._number:
                columns = answer.columns
                self._results[answer.piece] = None if columns is None else Rolled(columns)
        return self._results


@runtime_checkable
class AsksTwin(Protocol):
    """A motion that can ask a twin about its next pieces."""

    def use_asker(self, asker: TwinAsker) -> None:
        """Ask through ``asker``."""
        ...
