"""Synthetic motion capture ([YT] 3): the physics runs an action until it has settled."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.kinematics.frame import body_frame
from snakewalk.controller.kinematics.smoothstep import cubic_sum
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.repertoire_physics import FRAME_S, PhysicsBody
from snakewalk.controller.repertoire.segment import REVERSE, Kind, Segment, cut
from snakewalk.controller.run.servo_setup import check_supply

SETTLING = 3
"""Whole cycles before the one that is kept."""


@dataclass(frozen=True, slots=True)
class Action:
    """A lateral undulation with its own numbers; of a brake or a rest, the one that it ends."""

    name: str
    kind: Kind
    frequency_hz: float
    """Largest frequency; the joints' limits and whole frames may make it slower."""
    turn_rad: float = 0.0


ACTIONS = (
    Action("forward-slow", "forward", 0.3),
    Action("forward-medium", "forward", 0.5),
    Action("forward-fast", "forward", 0.8),
    Action("left-gentle", "left", 0.8, 0.6),
    Action("left-sharp", "left", 0.8, 1.5),
    Action("right-gentle", "right", 0.8, -0.6),
    Action("right-sharp", "right", 0.8, -1.5),
    Action("reverse", "reverse", 0.5),
    Action("left-slow", "left", 0.4, 1.0),
    Action("right-slow", "right", 0.4, -1.0),
    Action("reverse-left", "reverse-left", 0.4, -1.0),
    Action("reverse-right", "reverse-right", 0.4, 1.0),
    Action("brake", "brake", 0.8),
    Action("rest", "rest", 0.8),
)
"""Actions of [YT] 3.3: three speeds, gradual and sharp turns to either side. Slow turns, and turns
backward, are ours. Braking and retreating, which the paper derives from a forward action, are
recorded."""
REST_S = 0.5


def record(
    robot: RobotConfig,
    world: WorldConfig,
    actions: tuple[Action, ...] = ACTIONS,
    on_progress: Callable[[str, float], None] = lambda name, share: None,
) -> Repertoire:
    """Record every action; ``on_progress`` receives the name and its share, 0 to 1.

    Raises:
        InputError: joints are missing, or do not bend so far; the supply is not the servos'.
        SafetyTrippedError: the simulated servos were asked too much.

    """
    check_supply(robot)
    segments = tuple(record_action(robot, world, action, on_progress) for action in actions)
    return Repertoire(
        robot.name,
        robot.joint_axes,
        world.name,
        robot.length_m,
        segments,
        world.friction.law_text,
        world.ground.kind == "water",
    )


def record_action(
    robot: RobotConfig,
    world: WorldConfig,
    action: Action,
    on_progress: Callable[[str, float], None] = lambda name, share: None,
) -> Segment:
    """Run one action from rest, and keep the cycle after ``SETTLING`` others.

    A brake lasts as long as two cycles, with falling speed; a rest is recorded after it.
    """
    parameters: dict[str, Any] = {
        "turn_rad": action.turn_rad,
        "frequency_hz": action.frequency_hz,
        "backward": action.kind in REVERSE,
    }
    asked = GaitCycle(make_gait("lateral-undulation", parameters), robot)
    count = int(np.ceil(1.0 / (asked.frequency_hz * FRAME_S) - 1e-9))
    parameters["frequency_hz"] = 1.0 / (count * FRAME_S)
    motion = GaitMotion(make_gait("lateral-undulation", parameters), robot)
    frames = []
    links = []
    rotations = []
    goals = []
    joints = []
    with PhysicsBody(robot, world, motion.goal_rad()) as body:
        while motion.cycles < SETTLING:
            body.frame(motion.step(FRAME_S, body.view()))
            on_progress(action.name, motion.cycles / (SETTLING + 1))
        # from phase 0 on, so that all actions begin alike
        while min(motion.phase_rad, TURN - motion.phase_rad) > 0.51 * TURN / count:
            body.frame(motion.step(FRAME_S, body.view()))
        kept = np.arange(count + 1) / count
        if action.kind in {"brake", "rest"}:
            share = np.arange(2 * count + 1) / (2 * count)
            kept = 2.0 * (share - cubic_sum(share))  # rate 1 - cubic, a cycle in the time of two
        sent = motion.gait.joints_rad(robot, motion.phase_rad + TURN * kept)
        if action.kind == "rest":
            for goal in sent[1:]:
                body.frame(goal)
            sent = np.repeat(sent[-1:], round(REST_S / FRAME_S) + 1, axis=0)
            for _ in range(3):
                for goal in sent:
                    body.frame(goal)
        for k, goal in enumerate(sent):
            view = body.view()
            frames.append(body_frame(view.link_m))
            links.append(view.link_m)
            rotations.append(view.rotation)
            joints.append(body.joint_rad)
            if k < len(sent) - 1:
                goals.append(goal)
                body.frame(sent[k + 1])
                on_progress(action.name, (SETTLING + k / len(sent)) / (SETTLING + 1))
    return cut(
        action.name,
        action.kind,
        FRAME_S,
        frames,
        np.array(links),
        np.array(rotations),
        np.array(goals),
        np.array(joints),
    )
