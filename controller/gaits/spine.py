"""Swimming with the spine: four modes of fish, as a wave that travels from head to tail.

[GC] prints a standing wave (Eq. 11), which gives no thrust. Its table of modes drives Lighthill's
travelling form here; ``standing`` selects the printed form. Amplitudes are printed without a unit
and read in that of ``u``: a body is 2 pi long.
"""

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import Field

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Frequency, Gait, GaitParameters, Needs
from snakewalk.controller.gaits.wave import TURN, places

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig

SAMPLES = 257
"""Number of samples of the spine, before it is divided into equal links."""
SOURCE = (
    "G. Gonzalez Castro, M. Athanasopoulos, H. Ugail et al., Cyclic animation using partial "
    "differential equations, The Visual Computer 26, 2010, Table 1; travelling form: "
    "M. J. Lighthill, Annual Review of Fluid Mechanics 1, 1969"
)
Nose = Annotated[float, Field(ge=0.0, le=1.5, description="amplitude at the head, body = 2 pi")]
Tail = Annotated[float, Field(ge=0.0, le=1.5, description="amplitude at the tail, body = 2 pi")]
Waves = Annotated[float, Field(ge=0.1, le=3.0, description="number of waves on the body: alpha")]
StandingPhase = Annotated[
    float, Field(ge=-np.pi, le=np.pi, description="phase of the standing form only: phi")
]


class SpineParameters(GaitParameters):
    """One row of the table."""

    nose: Nose = 0.0
    tail: Tail = 0.3
    waves: Waves = 1.5
    phase_rad: StandingPhase = float(np.pi / 2)
    standing: bool = Field(False, description="Eq. 11 as printed: no thrust")
    turn_rad: float = Field(0.0, ge=-2.5, le=2.5, description="bend over the body; positive: left")
    fold_rad: float = Field(
        1.1, ge=0.0, le=1.57, description="angle by which legs fold back at the hip"
    )


@cache
def heading_loop() -> Callable[..., None]:
    """Return the compiled loop of ``spine_heading``."""
    from snakewalk.controller.gaits.spine_heading import write_headings  # noqa: PLC0415  compiled: slow to import

    return write_headings


def spine_bends_rad(
    phase_rad: Floats, joints: int, p: SpineParameters, edges: Floats | None = None
) -> Floats:
    """(T, joints) bends of a chain of ``joints + 1`` links along the spine at phases (T,).

    The spine ``y(u)``, u from 0 at the head to 2 pi, is divided by arc length (equally, or at the
    shares ``edges``). The headings are therefore those of rigid links, not of slices in u.
    """
    write_headings = heading_loop()
    shares = np.linspace(0.0, 1.0, joints + 2) if edges is None else edges
    u = np.linspace(0.0, TURN, SAMPLES)
    headings = np.empty((len(phase_rad), len(shares) - 1))
    write_headings(u, _shapes(u, p), np.cos(phase_rad), np.sin(phase_rad), shares, headings)
    return headings[:, :-1] - headings[:, 1:]


def offset(u: Floats, phase_rad: Floats, p: SpineParameters) -> Floats:
    """(T, U) offset to the left, in the unit of ``u``; the phase is ``2 pi omega t``."""
    return np.stack([np.cos(phase_rad), np.sin(phase_rad)], axis=1) @ _shapes(u, p)


def _shapes(u: Floats, p: SpineParameters) -> Floats:
    """(2, U) factors of the offset for the cosine and the sine of the phase."""
    size = p.nose + (p.tail - p.nose) * u / TURN
    if p.standing:  # size cos(waves u + phi) sin(phase)
        return np.stack([np.zeros_like(u), size * np.cos(p.waves * u + p.phase_rad)])
    return np.stack([size * np.sin(p.waves * u), -size * np.cos(p.waves * u)])


class SpineGait(Gait):
    """A mode; subclasses give its row of the table."""

    source = SOURCE
    needs = Needs(yaw=True)
    model = SpineParameters
    world = "pool"
    steered_by: ClassVar[str | None] = "turn_rad"
    vertical: ClassVar[bool] = False

    def _shape_rad(self, robot: "RobotConfig", phase_rad: Floats) -> Floats:
        p = self.params
        bent_joints = robot.pitch_joints if self.vertical else robot.yaw_joints
        edges = np.concatenate([[0.0], places(robot, bent_joints), [1.0]])
        joints = np.zeros((len(phase_rad), robot.joint_count))
        joints[:, bent_joints] = spine_bends_rad(phase_rad, len(bent_joints), p, edges)
        if robot.yaw_joints:
            joints[:, robot.yaw_joints] += p.turn_rad / len(robot.yaw_joints)
        for k, joint in enumerate(robot.limb_joints):
            if joint.place == robot.limbs[joint.pair].joint_axes.find("y"):
                joints[:, robot.link_count - 1 + k] = -p.fold_rad
        return joints


class AnguilliformParameters(SpineParameters):
    """Eel: Omega = 0.3 u / 2 pi, alpha 1.5, omega 1."""

    frequency_hz: Frequency = 1.0


class Anguilliform(SpineGait):
    """The complete body moves."""

    name = "anguilliform"
    title = "swims as an eel does: one and a half waves, growing to the tail"
    model = AnguilliformParameters


class SubcarangiformParameters(SpineParameters):
    """Trout: Omega = u / 2 pi, alpha 0.75, omega 2."""

    frequency_hz: Frequency = 2.0
    tail: Tail = 1.0
    waves: Waves = 0.75


class Subcarangiform(SpineGait):
    """The rear two thirds move most."""

    name = "subcarangiform"
    title = "swims as a trout does: three quarters of a wave, growing to the tail"
    model = SubcarangiformParameters


class CarangiformParameters(SpineParameters):
    """Tropical fish: Omega = 0.1, alpha 1, omega 2."""

    frequency_hz: Frequency = 2.0
    nose: Nose = 0.1
    tail: Tail = 0.1
    waves: Waves = 1.0


class Carangiform(SpineGait):
    """The same small amplitude everywhere, as printed."""

    name = "carangiform"
    title = "swims as a tropical fish does: one small wave of even amplitude"
    model = CarangiformParameters


class ThunniformParameters(SpineParameters):
    """Shark: Omega = u / 2 pi, alpha 0.25, phi 0, omega 1."""

    frequency_hz: Frequency = 1.0
    tail: Tail = 1.0
    waves: Waves = 0.25
    phase_rad: StandingPhase = 0.0


class Thunniform(SpineGait):
    """A quarter of a wave: nearly a swinging tail."""

    name = "thunniform"
    title = "swims as a shark does: a quarter of a wave, mostly tail"
    model = ThunniformParameters


class DolphinParameters(SpineParameters):
    """Dolphin: Omega = 1, alpha 0.75, omega 1.3; up and down."""

    frequency_hz: Frequency = 1.3
    nose: Nose = 1.0
    tail: Tail = 1.0
    waves: Waves = 0.75


class Dolphin(SpineGait):
    """The second thunniform row of the table, up and down."""

    name = "thunniform-dolphin"
    title = "swims as a dolphin does: three quarters of a wave, up and down"
    needs = Needs(pitch=True)
    steered_by = None
    model = DolphinParameters
    vertical = True
