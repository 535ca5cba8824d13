"""Base class of gaits: joint angles over a phase, required joints, and source."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.config.base import Strict
from snakewalk.config.errors import InputError
from snakewalk.config.field_facts import bounds_of, description_of
from snakewalk.config.loader import checked

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig

CYCLE_SAMPLES = 129
"""Phases at which a cycle is sampled; the first and the last are the same."""
Aim = Literal["advance", "climb", "turn"]
"""Ground covered, height won, or the heading turned."""


@dataclass(frozen=True, slots=True)
class Needs:
    """The joints that a motion needs."""

    yaw: bool = False
    pitch: bool = False
    legs: bool = False
    """Whether two pairs of legs are used."""
    leg_axes: str = ""
    """Axes of each leg from the hip; empty: any axes."""
    wheels: bool = False
    """Whether the gait needs a belly that slides more easily along than across."""

    @classmethod
    def of(cls, robot: "RobotConfig", joint_rad: Floats) -> Self:
        """Return the needs of joint angles (T, J)."""
        yaw, pitch = (bool(joint_rad[:, k].any()) for k in (robot.yaw_joints, robot.pitch_joints))
        return cls(yaw, pitch)

    def check(self, robot: "RobotConfig", what: str) -> None:
        """Reject a robot that lacks the joints.

        Raises:
            InputError: the joints are missing.

        """
        for is_needed, have, axis in (
            (self.yaw, robot.yaw_joints, "yaw"),
            (self.pitch, robot.pitch_joints, "pitch"),
        ):
            if is_needed and not have:
                raise InputError(
                    f"{what} needs {axis} joints; robot {robot.name} has none "
                    f"(joint_axes {robot.joint_axes}); choose another with --robot"
                )
        if self.legs and len(robot.limbs) != 2:
            raise InputError(
                f"{what} needs two pairs of legs; robot {robot.name} has {len(robot.limbs)} "
                "(tables [[limbs]])"
            )
        for pair in robot.limbs if self.leg_axes else ():
            if pair.joint_axes != self.leg_axes:
                raise InputError(
                    f"{what} needs legs of joint_axes {self.leg_axes}; those of robot {robot.name} "
                    f"at link {pair.link} are {pair.joint_axes}"
                )


def fitting_robot(needs: Iterable[Needs]) -> str:
    """Name of a shipped robot that has the joints of all given motions."""
    all_needs = list(needs)
    if any(need.legs for need in all_needs):
        return "quadruped" if any(need.leg_axes for need in all_needs) else "salamander"
    return "alternating16" if any(need.pitch for need in all_needs) else "yaw16"


Frequency = Annotated[float, Field(ge=0.0, le=2.0, description="cycles a second")]


class GaitParameters(Strict):
    """Parameters of every gait."""

    frequency_hz: Frequency = 0.5
    mirror: bool = Field(False, description="left and right exchanged")


class Gait(ABC):
    """A periodic map from a phase to ``joints_rad``; a ``GaitMotion`` supplies the phase.

    A subclass defines the class variables and ``_shape_rad``.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    """Motion of the body in one line."""
    source: ClassVar[str]
    """Author of the description."""
    needs: ClassVar[Needs]
    world: ClassVar[str] = "isotropic"
    """Shipped world of the gait's runs, where none is given."""
    p_gain: ClassVar[int | None] = None
    """P gain (register 84) of every servo if the robot's own would squeeze too hard."""
    steered_by: ClassVar[str | None] = None
    """Parameter that steers the gait along waypoints, positive to the left; None: the gait is not
    steered."""
    follows_velocity: ClassVar[bool] = False
    """Whether its rate and its ``turn_rad`` set how fast the body goes along itself and turns."""
    aim: ClassVar[Aim] = "advance"
    """Purpose that measures the gait's speed."""
    model: ClassVar[type[GaitParameters]] = GaitParameters

    def __init__(self, params: GaitParameters | None = None) -> None:
        self.params: Any = self.model() if params is None else params
        """An instance of ``model``."""

    @classmethod
    def of(cls, values: dict[str, Any] | None = None, source: str = "") -> Self:
        """Make the gait with ``values`` in place of defaults.

        Raises:
            ConfigError: unknown parameters or values out of range, one line each.

        """
        return cls(checked(cls.model, dict(values or {}), source or f"gait {cls.name}"))

    def joints_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        """(T, J) joint angles at phases (T,), period 2 pi.

        Raises:
            InputError: the robot lacks joints that the gait needs.

        """
        self.needs.check(robot, f"gait {self.name}")
        joints = self._shape_rad(robot, np.atleast_1d(np.asarray(phase_rad, dtype=float)))
        if self.params.mirror:
            joints[:, robot.yaw_joints] *= -1.0
        return joints

    def check(self, robot: "RobotConfig") -> None:
        """Reject a robot that lacks joints, or whose joint limits are too small.

        Raises:
            InputError: the first fault.

        """
        joints = self.joints_rad(robot, np.linspace(0.0, 2.0 * np.pi, CYCLE_SAMPLES))
        turn_rad = getattr(self.params, "turn_rad", 0.0)
        if turn_rad and not robot.yaw_joints:
            raise InputError(
                f"gait {self.name}: turn_rad {turn_rad:g} needs yaw joints; robot {robot.name} has "
                f"none (joint_axes {robot.joint_axes})"
            )
        reach = np.abs(joints).max(axis=0)
        limit = np.array(robot.limit_rad)
        beyond = np.flatnonzero(reach > limit + 1e-9)
        if len(beyond):
            worst = int(beyond[np.argmax((reach - limit)[beyond])])
            raise InputError(
                f"gait {self.name}: {robot.joint_label(worst)} would bend to {reach[worst]:.2f} "
                f"rad; its limit is {limit[worst]:.2f}"
            )

    @abstractmethod
    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        """(T, J), a fresh array, before mirroring and limits."""


@dataclass(frozen=True, slots=True)
class Range:
    """Kind, default, bounds and description of one parameter."""

    kind: type
    """Type of the parameter: float, int or bool."""
    default: float
    low: float
    high: float
    description: str
    """Description of the parameter in one line."""

    @property
    def step(self) -> float:
        """Change per key press: a fortieth of the range, 1 for whole numbers."""
        return (self.high - self.low) / 40.0 if self.kind is float else 1.0


def ranges(model: type[GaitParameters]) -> dict[str, Range]:
    """Ranges by parameter, in the order of the model; 0 to 1 for a switch."""
    ranges_by_name: dict[str, Range] = {}
    kinds: dict[object, type] = {int: int, bool: bool}
    for name, field in model.model_fields.items():
        bounds = {"gt": 0.0, "lt": 1.0} | bounds_of(field)
        ranges_by_name[name] = Range(
            kind=kinds.get(field.annotation, float),
            default=float(field.default),
            low=float(bounds.get("ge", bounds["gt"])),
            high=float(bounds.get("le", bounds["lt"])),
            description=description_of(field),
        )
    return ranges_by_name
