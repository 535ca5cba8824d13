"""A running gait that changes and stops within the robot's limits; and a sequence of gaits."""

from collections.abc import Callable, Sequence
from typing import Any

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.source_switch import SourceSwitch
from snakewalk.controller.motion.stop_profile import StopProfile
from snakewalk.controller.motion.wrapper import MotionWrapper


class GaitMotion(MotionWrapper):
    """A gait that starts from rest, changes its parameters without a step, and can stop."""

    def __init__(
        self,
        gait: Gait,
        robot: RobotConfig,
        *,
        phase_rad: float = 0.0,
        duration_s: float | None = None,
        on_limit: Callable[[str], None] = lambda text: None,
    ) -> None:
        """Prepare at ``phase_rad``; after ``duration_s`` the motion comes to rest.

        ``on_limit`` gets a sentence for each gait that the joints cannot follow as fast as asked.

        Raises:
            InputError: joints are missing, or their limits are too small.

        """
        self._robot = robot
        self._cycle = GaitCycle(gait, robot, phase_rad)
        self._switch = SourceSwitch(robot, self._cycle)
        super().__init__(self._switch)
        self._remaining_s = duration_s
        self._on_limit = on_limit
        self._report_limit()
        self._stop_profile = StopProfile()
        self.cycles = 0.0
        """Number of cycles of the gait so far."""

    @property
    def gait(self) -> Gait:
        """Present gait."""
        return self._cycle.gait

    @property
    def phase_rad(self) -> float:
        """Phase of the gait, 0 to 2 pi."""
        return self._cycle.phase_rad

    @property
    def frequency_hz(self) -> float:
        """Present cycles per second."""
        return self._cycle.frequency_hz * self._stop_profile.rate

    @property
    def done(self) -> bool:
        """Whether the motion rests after ``stop`` or its duration."""
        return self._stop_profile.over

    @property
    def stopping(self) -> bool:
        """Whether the motion is coming to rest, or rests."""
        return self._stop_profile.begun

    def change(self, **values: Any) -> float:
        """Change parameters at the present phase; return the duration of the change, s.

        Raises:
            InputError: unknown parameter, out of range, or beyond the joints; nothing changes then.

        """
        kept = self.gait.params.model_dump()
        return self.become(type(self.gait).of(kept | values))

    def become(self, gait: Gait) -> float:
        """Change to another gait at the present phase; return the duration, s.

        Raises:
            InputError: joints are missing, or their limits are too small; nothing changes then.

        """
        cycle = GaitCycle(gait, self._robot, self.phase_rad)
        duration_s = self._switch.join(cycle)
        self._cycle = cycle
        self._report_limit()
        return duration_s

    def _report_limit(self) -> None:
        if self.limit is not None:
            self._on_limit(self.limit)

    @property
    def limit(self) -> str | None:
        """Sentence on a frequency that the joints cannot follow; None if they can."""
        asked_hz = self.gait.params.frequency_hz
        if self._cycle.frequency_hz >= asked_hz - 1e-9:
            return None
        return f"{asked_hz:g} Hz is too fast for the joints: {self._cycle.frequency_hz:.2f} Hz"

    def stop(self) -> None:
        """Come to rest along a ``StopProfile``."""
        self._stop_profile.stop()

    def velocity_rad_s(self) -> Floats:
        """(J,) present speeds of the joint targets."""
        return self._stop_profile.rate * self._switch.velocity_rad_s()

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new targets (J,)."""
        if self._remaining_s is not None:
            self._remaining_s -= dt_s
            if self._remaining_s <= 0.0:
                self.stop()
        part_s = self._stop_profile.step(dt_s)
        self.cycles += part_s * self._cycle.frequency_hz
        return self._switch.step(part_s, view)


class GaitSequence(MotionWrapper):
    """Runs a ``GaitMotion`` through gaits."""

    def __init__(self, motion: GaitMotion, changes: Sequence[tuple[float, Gait]]) -> None:
        """Adopt gaits at rising times of the motion's own time; all must suit its robot."""
        super().__init__(motion)
        self.motion = motion
        self._changes = list(changes)
        self._now_s = 0.0

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Change the gait if due, then advance by ``dt_s``."""
        while self._changes and self._now_s >= self._changes[0][0] - 1e-9:
            self.motion.become(self._changes.pop(0)[1])
        self._now_s += dt_s
        return self.motion.step(dt_s, view)
