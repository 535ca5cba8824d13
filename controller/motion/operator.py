"""A live operator as a motion source: keys change a gait, its parameters and its rate.

Keys are names, from a keyboard, a gamepad, the page or a test; values are ``PARAMETER=VALUE``.
Changes use the joins of all motion sources, so an operator cannot cause a step.
"""

import math
from collections.abc import Callable, Iterable

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Range, ranges
from snakewalk.controller.gaits.registry import GAITS, make_gait
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.command import Refused
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.refusals import Refusals
from snakewalk.controller.motion.source import Pace
from snakewalk.controller.motion.wrapper import MotionWrapper

KEYS = {
    "up": "the parameter before",
    "down": "the next parameter",
    "left": "less of it",
    "right": "more of it",
    "n": "next gait",
    "p": "gait before",
    "m": "mirror",
    "d": "defaults",
    "space": "halt, go on",
    "q": "stop",
    "t": "torque off",
}
HALT_S = 0.5
_DIRECTIONS = ("mirror", "backward", "turn_rad", "turn", "left_handed")
"""Parameters that say which way a gait goes; another gait starts with its defaults."""
_KEYS_MAX = 100
"""Keys and values that are carried out in a step (ours); text that is pasted is longer."""


class Operator(MotionWrapper):
    """Runs a gait and changes it by keys."""

    def __init__(
        self,
        motion: GaitMotion,
        robot: RobotConfig,
        keys: Callable[[], Iterable[str | Refused]],
        on_event: Callable[[str, str], None],
        is_enabled: Callable[[], bool] = lambda: True,
    ) -> None:
        """Let ``keys`` control ``motion``.

        Args:
            motion: the first gait.
            robot: gaits must suit it.
            keys: names of ``KEYS`` pressed since the last call, ``PARAMETER=VALUE`` and
                ``gait=NAME``, and reasons for dropped ones; others are ignored, also ``t``, which
                the owner of the torque handles.
            on_event: called with ("operator", text) for an action that was done or refused.
            is_enabled: whether the dead man's button is held; otherwise the body keeps its
                shape, whatever else is pressed.

        """
        super().__init__(motion)
        self.motion = motion
        self._robot = robot
        self._keys = keys
        self._on_event = on_event
        self._chosen = 0
        self._halted = False
        self._refusals = Refusals(lambda why: on_event("operator", f"refused: {why}"))
        self._time_s = 0.0
        self._held = is_enabled
        self._was_held = True
        self._rate = 1.0

    @property
    def selected(self) -> str:
        """Parameter that left and right change."""
        return list(self._ranges())[self._chosen]

    def velocity_rad_s(self) -> Floats:
        """(J,) present speeds of the joint targets."""
        return self._rate * self.motion.velocity_rad_s()

    def pace(self) -> Pace:
        """Limits of the robot, since later commands are unknown."""
        return Pace.limit(self._robot)

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Execute the pressed keys, then advance by ``dt_s``."""
        self._time_s += dt_s
        keys = list(self._keys())
        for key in keys[:_KEYS_MAX]:
            self._press(key)
        if len(keys) > _KEYS_MAX:
            self._refuse(f"{len(keys)} keys at once; only the first {_KEYS_MAX} count")
        self._refusals.step(self._time_s)
        change = dt_s / HALT_S
        before = self._rate
        is_enabled_now = self._held()
        if is_enabled_now != self._was_held:
            self._was_held = is_enabled_now
            self._report(
                "held: it moves" if is_enabled_now else "button released: the body holds its shape"
            )
        halted = self._halted and not self.motion.stopping
        target = 0.0 if halted or not is_enabled_now else 1.0
        self._rate += min(max(target - self._rate, -change), change)
        return self.motion.step(0.5 * (before + self._rate) * dt_s, view)

    def _press(self, key: str | Refused) -> None:
        if isinstance(key, Refused):
            self._refuse(key.why)
            return
        name, equals, value = key.partition("=")
        if equals:
            self._assign(name, value)
        elif key in {"up", "down"}:
            self._chosen = (self._chosen + (1 if key == "down" else -1)) % len(self._ranges())
            self._report(f"{self.selected} = {getattr(self.motion.gait.params, self.selected)}")
        elif key in {"left", "right"}:
            self._nudge(self.selected, 1.0 if key == "right" else -1.0)
        elif key in {"n", "p"}:
            self._select_other_gait(1 if key == "n" else -1)
        elif key == "m":
            self._change(mirror=not self.motion.gait.params.mirror)
        elif key == "d":
            self._become(self.motion.gait.name)
        elif key == "space":
            self._halted = not self._halted
            self._report("halt" if self._halted else "go on")
        elif key == "q":
            self.motion.stop()
            self._report("stop")

    def _assign(self, name: str, text: str) -> None:
        """Execute ``NAME=TEXT``."""
        if name == "gait":
            self._become(text)
            return
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if name in self._ranges() and math.isfinite(value):
            span = self._ranges()[name]
            if not span.low <= value <= span.high:
                self._report(f"{name} = {text} is outside {span.low:g} to {span.high:g}")
            self._set_parameter(name, value)
        else:
            self._refuse(f"{name}={text}: is not a number for a parameter of this gait")

    def _nudge(self, name: str, sign: float) -> None:
        step = sign * self._ranges()[name].step
        self._set_parameter(name, getattr(self.motion.gait.params, name) + step)

    def _set_parameter(self, name: str, value: float) -> None:
        span = self._ranges()[name]
        value = min(max(value, span.low), span.high)
        self._change(**{name: span.kind(round(value, 6))})

    def _change(self, **values: float) -> None:
        try:
            self.motion.change(**values)
        except InputError as error:
            self._refuse(error.faults[0])
        else:
            self._report(", ".join(f"{name} = {value}" for name, value in values.items()))

    def _select_other_gait(self, step: int) -> None:
        names = list(GAITS)
        index = names.index(self.motion.gait.name) if self.motion.gait.name in names else 0
        for away in range(1, len(names)):
            if self._become(names[(index + step * away) % len(names)], quietly=True):
                return
        self._refuse("no other gait suits this robot")

    def _become(self, name: str, *, quietly: bool = False) -> bool:
        before = self.motion.gait.params
        try:
            self.motion.become(make_gait(name))
        except InputError as error:
            if not quietly:
                self._refuse(error.faults[0])
            return False
        self._chosen = 0
        after = self.motion.gait.params
        lost = [
            direction
            for direction in _DIRECTIONS
            if getattr(before, direction, 0)
            and getattr(after, direction, 0) != getattr(before, direction)
        ]
        self._report(f"gait {name}")
        if lost:
            self._report(f"gait {name} does not keep {', '.join(lost)}")
        return True

    def _ranges(self) -> dict[str, Range]:
        return ranges(self.motion.gait.model)

    def _refuse(self, why: str) -> None:
        self._refusals.add(why, self._time_s)

    def _report(self, text: str) -> None:
        self._on_event("operator", text)
