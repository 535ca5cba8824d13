"""From a gait's name and parameters to a job: robot with stiff pitch joints, gait, start."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from config.errors import InputError
from config.gait import GaitConfig, GaitSetConfig
from config.ground import build_ground
from config.heightfield import HeightField
from config.loader import checked, load_gait, load_robot, load_world, shipped
from config.robot import RobotConfig
from config.run import RunConfig
from config.world import WorldConfig
from controller.gaits.gait import Gait
from controller.gaits.registry import GAITS, make_gait
from controller.motion.cpg_motion import CpgMotion
from controller.motion.gait_motion import Cycle, GaitMotion
from controller.motion.gait_sequence import GaitSequence
from controller.motion.head_steering import HeadSteering, Look
from controller.motion.source import MotionSource
from controller.runtime.forecast import mean_heading_rad
from controller.runtime.guide import Guide, SourceGuide
from drivers.budget import wire_budget
from drivers.telemetry.record import Laid, PlanSummary

GAIT_PITCH_CURRENT_A = 1.5
"""Goal current of the pitch joints in a gait that lifts: soft ones would not carry the links."""

Live = Callable[[GaitMotion, RobotConfig, Callable[[str, str], None]], MotionSource]
"""Puts a live operator between a gait and the servos."""


@dataclass(frozen=True)
class PreparedGait:
    """A gait run: everything that is known before a servo moves."""

    run: RunConfig
    robot: RobotConfig
    world: WorldConfig
    live: Live | None = None
    gain: float = field(default=float("nan"), init=False)

    @property
    def config(self) -> GaitConfig:
        """The run's table ``gait``."""
        if self.run.gait is None:
            raise InputError(f"run {self.run.name}: has no table [gait]")
        return self.run.gait

    @cached_property
    def gait(self) -> Gait:
        """With its parameters."""
        return make_gait(self.config.name, self.config.parameters, f"gait {self.config.name}")

    @cached_property
    def later(self) -> list[tuple[float, Gait]]:
        """What it changes to, and when."""
        return [(c.at_s, make_gait(c.name, c.parameters)) for c in self.config.then]

    @cached_property
    def ground(self) -> HeightField | None:
        """The world's height field; None on a flat floor."""
        return build_ground(self.world)

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        return self.run.start_heading_rad or 0.0

    def laid(self) -> Laid:
        """In the shape that the gait begins with; the first joint angles are held meanwhile."""
        joints = Cycle(self.gait, self.robot).goal_rad()
        return Laid(self.start_heading_rad - mean_heading_rad(self.robot, joints), joints)

    def judged(self) -> PlanSummary:
        """A gait is checked against the joints' range; its speed is kept within limits live."""
        for gait in (self.gait, *(gait for _, gait in self.later)):
            gait.check(self.robot)
        start = np.array([self.run.start_m, self.run.start_m], dtype=float)
        return PlanSummary(start, np.zeros((0, 2)), self.run.waypoint_radius_m)

    def motion(self, say: Callable[[str, str], None]) -> MotionSource:
        """Return a fresh motion source: gait, live operator and head steering, as asked."""
        gait = GaitMotion(self.gait, self.robot, duration_s=self.config.duration_s)
        asked_hz = self.gait.params.frequency_hz
        if gait.frequency_hz < asked_hz - 1e-9:
            say("limit", f"{asked_hz:g} Hz is too fast for the joints: {gait.frequency_hz:.2f} Hz")
        source: MotionSource = gait
        if self.live is not None:
            source = self.live(gait, self.robot, say)
        elif self.config.by == "cpg":
            source = CpgMotion(self.robot, Cycle(self.gait, self.robot).goal_rad())
            source.schedule([(0.0, self.gait), *self.later, (self.config.duration_s, None)])
        elif self.later:
            source = GaitSequence(gait, self.later)
        look = Look(self.config.look_heading_rad, self.config.look_at_m)
        if look == Look():
            return source
        return HeadSteering(source, self.robot, look)

    def guide(self, say: Callable[[str, str], None]) -> Guide:
        """Return a fresh guide of the motion."""
        return SourceGuide(self.motion(say))


def prepare_gait(
    name: str,
    *,
    robot: str | None = None,
    world: str | None = None,
    parameters: dict[str, Any] | None = None,
    seconds: float = 20.0,
    seed: int = 0,
    look_heading_rad: float | None = None,
    look_at_m: tuple[float, float] | None = None,
    live: Live | None = None,
    then: Sequence[tuple[float, str, dict[str, Any]]] = (),
    by: Literal["blend", "cpg"] = "blend",
) -> PreparedGait:
    """Prepare a gait, or a shipped or own set of parameters (``config/gaits``), by name.

    ``then`` holds (time, name, parameters) of what it changes to, ``by`` how.

    Raises:
        InputError: no such gait, parameters out of range, a robot that lacks joints, changes out of
            order or together with an operator.

    """
    if live is not None and (then or by == "cpg"):
        raise InputError("--live changes gaits by keys and joins: leave out --then and --by cpg")
    gait, known = _named(name, parameters)
    if known is not None:
        robot, world = robot or known.robot, world or known.world
    later = [(at_s, _named(other, values)[0]) for at_s, other, values in then]
    all_gaits = [gait, *(other for _, other in later)]
    pitch = any(each.needs.pitch for each in all_gaits)
    body = load_robot(robot or ("alternating16" if pitch else "yaw16"))
    for each in all_gaits:
        each.check(body)
    run = checked(
        RunConfig,
        {
            "name": name.removesuffix(".toml").rpartition("/")[2],
            "robot": body.name,
            "world": world or gait.world,
            "motion": "gait",
            "seed": seed,
            "time_limit_s": seconds + (60.0 if by == "cpg" else 30.0),
            "gait": {
                "name": gait.name,
                "parameters": gait.params.model_dump(),
                "duration_s": seconds,
                "look_heading_rad": look_heading_rad,
                "look_at_m": look_at_m,
                "then": [
                    {"at_s": at_s, "name": g.name, "parameters": g.params.model_dump()}
                    for at_s, g in later
                ],
                "by": by,
            },
        },
        "command line",
    )
    wire_budget(body.joint_count, body.servo.baud, fast=True, slow_read_bytes=7).check(run.cycle_hz)
    return PreparedGait(run, _tuned(body, all_gaits), load_world(run.world), live)


def _named(name: str, parameters: dict[str, Any] | None) -> tuple[Gait, GaitSetConfig | None]:
    """Make a gait by its name or that of a set of parameters, and return the set."""
    if name in GAITS:
        return make_gait(name, parameters), None
    if name not in shipped("gaits") and not name.endswith(".toml"):
        raise InputError(
            f"{name}: no such gait; there are {', '.join(GAITS)}; "
            f"sets of parameters: {', '.join(shipped('gaits'))}; your own ends in .toml"
        )
    known = load_gait(name)
    return make_gait(known.gait, dict(known.parameters) | (parameters or {})), known


def _tuned(robot: RobotConfig, gaits: Sequence[Gait]) -> RobotConfig:
    """Set servos up for the gaits: pitch joints that carry links, all of them softer if asked."""
    servo = robot.servo
    changes: dict[str, float] = {}
    if any(gait.needs.pitch for gait in gaits):
        changes["pitch_p_gain"] = max(servo.pitch_p_gain, servo.position_p_gain)
        changes["pitch_current_limit_a"] = max(servo.pitch_current_limit_a, GAIT_PITCH_CURRENT_A)
    soft = [gait.p_gain for gait in gaits if gait.p_gain is not None]
    if soft:
        changes["position_p_gain"] = changes["pitch_p_gain"] = min(soft)
    return robot.model_copy(update={"servo": servo.model_copy(update=changes)})
