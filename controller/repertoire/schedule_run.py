"""A run of recorded actions by wanted speed and turn, with the secondary controller ([YT] 5.1)."""

import csv
import io
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from snakewalk.config.archive import MOST_JSON_BYTES, read_text
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked, load
from snakewalk.config.schedule import RepertoireConfig, ScheduleConfig
from snakewalk.config.synthesis import curve_at
from snakewalk.controller.kinematics.frame import body_frame
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.motion.wrapper import MotionWrapper
from snakewalk.controller.repertoire.motion import RepertoireMotion
from snakewalk.controller.repertoire.repertoire import Repertoire, load_repertoire
from snakewalk.controller.repertoire.repertoire_planning import flat
from snakewalk.controller.repertoire.search import plane_pose
from snakewalk.controller.repertoire.secondary import SecondaryController
from snakewalk.controller.run.prepared_run import PathlessRun, plan_without_path, pose_with
from snakewalk.controller.runlog.record import InitialPose, PlanSummary
from snakewalk.controller.runtime.drive import OnEvent

COLUMNS = ("time_s", "speed_m_s", "turn_rad_s")
_SAMPLE_S = 0.1
_LASTING_S = 1.0
"""A request that lasts less is a transition to another one (ours)."""


def read_schedule(path: Path) -> ScheduleConfig:
    """Read a schedule: TOML, or CSV with the columns ``COLUMNS``, whose last time is its duration.

    Raises:
        InputError: every fault at once.

    """
    if path.suffix != ".csv":
        return load(path, ScheduleConfig)
    try:
        rows = csv.DictReader(io.StringIO(read_text(path, MOST_JSON_BYTES)))
        if tuple(rows.fieldnames or ()) != COLUMNS:
            raise InputError(f"{path}: expected the columns {','.join(COLUMNS)}")
        table = [[_number(path, rows.line_num, row[name]) for name in COLUMNS] for row in rows]
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not CSV: {error}") from None
    if not table:
        raise InputError(f"{path}: no rows")
    curves = {COLUMNS[k]: [[row[0], row[k]] for row in table] for k in (1, 2)}
    return checked(ScheduleConfig, curves | {"duration_s": table[-1][0]}, str(path))


def _number(path: Path, line: int, text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise InputError(f"{path}:{line}: {text or 'nothing'} where a number should be")
    return value


@dataclass(frozen=True)
class ScheduleRun(PathlessRun):
    """A ``PreparedRun`` of recorded actions without waypoints."""

    @property
    def config(self) -> RepertoireConfig:
        """The run's table ``repertoire``."""
        if self.run.repertoire is None:
            raise InputError(f"run {self.run.name}: has no table [repertoire]")
        return self.run.repertoire

    @cached_property
    def repertoire(self) -> Repertoire:
        """The recorded actions.

        Raises:
            InputError: no such file, actions of other joints, or a ground that is not flat.

        """
        loaded = load_repertoire(Path(self.config.file))
        loaded.check(self.robot)
        flat(self.world)
        return loaded

    @property
    def scale(self) -> float:
        """Length of this body, divided by the recorded body's."""
        return self.robot.length_m / self.repertoire.length_m

    def controller(self) -> SecondaryController:
        """Return a new motion for this body's size."""
        return SecondaryController(
            self.repertoire,
            scale=self.scale,
            patience=self.config.patience,
            seed=self.run.seed,
        )

    def initial_pose(self) -> InitialPose:
        """Return the shape with which the first action begins."""
        first = self.controller().choose(*self.requested(0.0))
        goals_rad = self.repertoire.segments[first].goal_rad
        return pose_with(self.robot, self.start_heading_rad, goals_rad[0])

    def requested(self, time_s: float) -> tuple[float, float]:
        """Wanted speed, m/s, and turn, rad/s."""
        asked = self.config
        return float(curve_at(asked.speed_m_s, time_s)), float(curve_at(asked.turn_rad_s, time_s))

    def check_plan(self) -> PlanSummary:
        """Check that the actions can have each constant speed and turn of the schedule in the mean.

        Raises:
            InputError: the actions cannot be loaded, or have no such mean.

        """
        fault = self._first_unreachable(is_constant=True)
        if fault is not None:
            raise InputError(fault)
        return plan_without_path(self.run)

    def remark(self) -> str | None:
        """Return a warning if the body may move much differently than requested."""
        recorded = self.repertoire.world
        world = self.world.name
        if world != recorded:
            return (
                f"{self.config.file}: recorded on world {recorded}; on {world} speeds, turns and "
                f"even directions may differ: record there, or leave --world out"
            )
        return self._first_unreachable(is_constant=False)

    def _first_unreachable(self, *, is_constant: bool) -> str | None:
        """Return the first request that lasts and that no actions meet in the mean, in words."""
        config = self.config
        control = self.controller()
        times_s = np.arange(0.0, config.duration_s, _SAMPLE_S)
        curves = (curve_at(curve, times_s) for curve in (config.speed_m_s, config.turn_rad_s))
        lasting = min(round(_LASTING_S / _SAMPLE_S), len(times_s))
        count = 0
        before = None
        for k, asked in enumerate(zip(*(curve.tolist() for curve in curves), strict=True)):
            if is_constant and asked != before:
                count = 0
            before = asked
            others = control.unreachable(*asked)
            count = count + 1 if others else 0
            if count == lasting:
                return (
                    f"{config.file}: its actions do not have {asked[0]:g} m/s and {asked[1]:g} "
                    f"rad/s in the mean (from {times_s[k - lasting + 1]:.1f} s); they have {others}"
                )
        return None

    def make_source(self, on_event: OnEvent) -> "ScheduleMotion":
        """Return a fresh motion."""
        return ScheduleMotion(self, on_event)


@dataclass(frozen=True, slots=True)
class PlayedAction:
    """One chosen action, and its measured motion."""

    begin_s: float
    action: int
    requested: tuple[float, float]
    """Speed, m/s, and turn, rad/s."""
    recorded: tuple[float, float]
    """Speed, m/s, and turn, rad/s, of the action at this body's size."""
    measured: tuple[float, float]
    """Speed, m/s, and turn, rad/s, of the body, over the time of the action and the join to it."""


class ScheduleMotion(MotionWrapper):
    """Asks the secondary controller for an action at the end of each, and comes to rest in time."""

    def __init__(self, prepared: ScheduleRun, on_event: OnEvent) -> None:
        self._prepared = prepared
        self._on_event = on_event
        self._controller = prepared.controller()
        self._now_s = 0.0
        self._begun: tuple[float, int, tuple[float, float], Floats] | None = None
        self.played: list[PlayedAction] = []
        """Actions that were played so far."""
        self._requested = prepared.requested(0.0)
        first = self._controller.choose(*self._requested)
        self._motion = RepertoireMotion(prepared.repertoire, prepared.robot, first, self._choose)
        super().__init__(self._motion)
        on_event("action", self._name(first))

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s`` and return the new targets (J,)."""
        if self._begun is None:
            self._begun = (self._now_s, self._motion.action, self._requested, _pose(view))
        if self._now_s >= self._prepared.config.duration_s:
            self._motion.stop()
        self._now_s += dt_s
        return self._motion.step(dt_s, view)

    def _name(self, action: int) -> str:
        return self._prepared.repertoire.segments[action].name

    def _choose(self, view: BodyView) -> int:
        assert self._begun is not None, "an action is being played"
        begin_s, before, requested, pose = self._begun
        now = _pose(view)
        segment = self._prepared.repertoire.segments[before]
        scale = self._prepared.scale
        recorded = scale * segment.speed_m_s, segment.turn_rad_s
        measured = _rates(pose, now, self._now_s - begin_s)
        self.played.append(PlayedAction(begin_s, before, requested, recorded, measured))
        self._requested = self._prepared.requested(self._now_s)
        action = self._controller.choose(*self._requested)
        self._begun = self._now_s, action, self._requested, now
        if action != before:
            self._on_event("action", self._name(action))
        return action


def _pose(view: BodyView) -> Floats:
    return plane_pose(body_frame(view.link_m))


def _rates(before: Floats, after: Floats, time_s: float) -> tuple[float, float]:
    """Speed along an arc, m/s, negative tail first, and turn, rad/s, between poses (3,)."""
    turn = float(wrap(after[2] - before[2]))
    x, y = after[:2] - before[:2]
    ahead = np.cos(before[2] + 0.5 * turn) * x + np.sin(before[2] + 0.5 * turn) * y
    arc_m = float(np.copysign(np.hypot(x, y), ahead)) / float(np.sinc(0.5 * turn / np.pi))
    return arc_m / time_s, turn / time_s
