"""Robot models of other programs as robot files: ``snakewalk robot import``.

MuJoCo reads axes, order and ranges of the joints, and lengths, masses and radii of the links. Links
here are straight, with their joints on one line and their mass spread evenly about it. Other
properties are rejected, or reported in a note. An anchor is moved along its axis to the line, which
changes no motion.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import Assumptions, ConfigError, InputError
from snakewalk.config.loader import checked
from snakewalk.config.reading import Fact, Facts, answered, by_user
from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_catalogue import servo_model as known_model
from snakewalk.controller.exchange.robot_import.body_tree import (
    BodyTree,
    Hinge,
    body_tree,
    centre_m,
)
from snakewalk.controller.exchange.robot_import.chain_directions import (
    ChainDirections,
    chain_directions,
)
from snakewalk.controller.exchange.robot_import.leg_pairs import LegPair, leg_pairs
from snakewalk.controller.exchange.robot_import.link_figures import (
    ChainFigures,
    LinkFigures,
    uneven_notes,
)
from snakewalk.controller.exchange.robot_import.model_compiler import load_model
from snakewalk.controller.exchange.robot_import.model_source import ModelSource
from snakewalk.controller.exchange.robot_import.robot_choice import NOTHING, RobotChoice
from snakewalk.controller.kinematics.links import body_in_world, chain_points_m
from snakewalk.drivers.types import BodyPose

_LARGEST_RANGE_RAD = 3.05
"""Half range of a joint that may turn for ever: a servo in position mode knows one turn."""
_NEXT_TO_NOTHING_KG = 2e-4
"""Mass of a link between two hinges of one body (ours): physics needs a mass."""
_POSES = 20
_TORQUE_N_M = (0.1, 100.0)
_PLAUSIBLE_SPEEDS_RAD_S = (0.1, 20.0)
"""Limits of torque and speed beyond which a stated limit is a placeholder (ours)."""
_HELD_SHARE = 2.0 / 2.3
"""Share of a servo's stall torque, up to which a run goes on: as for its current (ours)."""
_LENGTH_M = (0.0, 1.0)
_MASS_KG = (0.0001, 20.0)
_RADIUS_M = (0.002, 0.5)
"""Range that a robot file accepts for a link."""


@dataclass(frozen=True, slots=True)
class ImportedRobot:
    """A robot that was read from a model of another program."""

    robot: RobotConfig
    joint_names: tuple[str, ...]
    """Names of the joints in the model, in the order of the servos' IDs."""
    notes: tuple[str, ...]
    """Parts that were dropped, changed or assumed."""
    facts: Facts
    """Quantity, unit and order of the values."""
    kinematics_error_m: float
    """Largest distance of a joint's axis from the model's, in random poses within the ranges."""


def import_robot(
    path: Path,
    name: str,
    servo_model: str,
    choice: RobotChoice = NOTHING,
) -> ImportedRobot:
    """Read a robot; its joints get the IDs 1, 2, 3 ... from the head.

    Args:
        path: ``.xml`` (MJCF), ``.urdf``, ``.xacro`` or ``.sdf``.
        name: of the robot.
        servo_model: of all joints; a model knows no servos.
        choice: facts that the model may not state.

    Raises:
        InputError: the file is not a model, lacks a necessary value, or contains something that a
            robot's file cannot express.

    """
    return answered(path, choice, lambda choice: _import(path, name, servo_model, choice))


def _import(path: Path, name: str, servo_model: str, choice: RobotChoice) -> ImportedRobot:
    assumed = Assumptions(choice.assume)
    try:
        model, source = load_model(path, assumed)
        imported = _read(model, source, name, servo_model, choice, assumed)
        assumed.check_used(
            "keys: LINK.length_m, LINK.mass_kg, MESH.mass_kg, JOINT.limit_rad, radius_m"
        )
    except ConfigError as error:
        raise InputError(f"{path}: {error.faults[0]}") from None
    except InputError as error:
        named = [f"{path}: {fault.removeprefix(f'{path}: ')}" for fault in error.faults]
        raise InputError(named) from None
    return imported


def _read(
    model: mujoco.MjModel,
    source: ModelSource,
    name: str,
    servo_model: str,
    choice: RobotChoice,
    assumed: Assumptions,
) -> ImportedRobot:
    """``import_robot`` of a model that is compiled."""
    scale, reverse = choice.scale, choice.reverse
    masses = scale**3 if choice.mass_scale is None else choice.mass_scale
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    notes = list(source.notes)
    tree = body_tree(model, data, source)
    way_m = centre_m(model, data, tree.groups[-1]) - centre_m(model, data, tree.groups[0])
    directions = chain_directions(tree.hinges, way_m, reverse, notes)
    if reverse:
        tree = _reversed_tree(tree)
        directions = replace(directions, yaws=directions.yaws[::-1])
    figures = ChainFigures(model, data, tree, directions, source, assumed)
    notes += [
        *figures.notes,
        *uneven_notes(figures.links, tree.names),
        *_wheel_notes(figures.wheel_friction(source), tree),
    ]
    legs = leg_pairs(model, data, tree, directions, figures.joints_m, figures.links, notes)
    joints = _joints(model, tree, directions, reverse, notes, assumed)
    links = [
        replace(
            link,
            length_m=scale * link.length_m,
            mass_kg=masses * link.mass_kg,
            radius_m=scale * link.radius_m,
        )
        for link in figures.links
    ]
    _check_size(links, tree.names)
    keys = _keys(name, servo_model, links, joints, legs)
    if legs:
        keys["limbs"] = [_limb_keys(pair, scale, masses) for pair in legs]
        keys["joint_axes"] = "".join("y" if yaw else "p" for yaw in directions.yaws)
    keys |= _plan_limits(source, {hinge.name for hinge in tree.hinges}, servo_model, notes)
    robot = checked(RobotConfig, keys, name)
    worst_m = _kinematics_error_m(model, robot, tree.hinges, directions, scale, reverse=reverse)
    hinges = [*tree.hinges, *(hinge for pair in legs for hinge in pair.hinges)]
    notes += assumed.lines
    factors = f"lengths in {scale:g} m, masses in {masses:.4g} kg, angles in rad"
    is_scaled = scale != 1.0 or choice.mass_scale is not None
    facts: Facts = {
        "quantity": Fact("robot model", "file", "its format"),
        "unit": by_user("--scale, --mass-scale", factors if is_scaled else None)
        or Fact(factors, "file", "its format"),
        "order": by_user("--reverse", "tail first" if reverse else None)
        or Fact("head first", "inferred", "its first body; --reverse states the other end"),
    }
    names = tuple(hinge.name for hinge in hinges)
    return ImportedRobot(robot, names, tuple(notes), facts, worst_m)


def _reversed_tree(tree: BodyTree) -> BodyTree:
    last = len(tree.groups) - 1
    return BodyTree(
        tree.groups[::-1],
        tree.names[::-1],
        tree.hinges[::-1],
        [replace(branch, link=last - branch.link) for branch in tree.branches],
        tree.wheels,
    )


def _wheel_notes(friction: list[float], tree: BodyTree) -> list[str]:
    if not tree.wheels:
        return []
    states = (
        f"; they state a friction of {', '.join(f'{coefficient:g}' for coefficient in friction)}: "
        f"--set world.friction.across={friction[0]:g}"
        if friction
        else ""
    )
    return [
        f"{len(tree.wheels)} passive wheels are part of their links, mass and all; how they roll "
        f"along and hold across is the world's friction (along 0.1, across 0.7 by default){states}"
    ]


def _check_size(links: list[LinkFigures], names: list[str]) -> None:
    """Reject what is not of the size of servos, by the model's own names.

    Raises:
        InputError: a link is too long, heavy or thick, or too small.

    """
    for link, name in zip(links, names, strict=True):
        for what, value, (low, high), unit in (
            ("length", link.length_m, _LENGTH_M, "m"),
            ("mass", link.mass_kg, _MASS_KG, "kg"),
            ("radius", link.radius_m, _RADIUS_M, "m"),
        ):
            if value == 0.0 or low < value <= high:
                continue
            raise InputError(
                f"link {name}: its {what} is {value:.3g} {unit}, and must be over {low:g} and "
                f"at most {high:g} {unit}; use --scale, and --mass-scale 1 for a model in "
                "millimetres"
            )


def _keys(
    name: str,
    servo_model: str,
    links: list[LinkFigures],
    joints: list[dict[str, object]],
    legs: list[LegPair],
) -> dict[str, object]:
    radius_m = round(max(link.radius_m for link in links), 6)
    return {
        "name": name,
        "body_radius_m": radius_m,
        "servo": {"model": servo_model},
        "joints": [
            *joints,
            *(
                {"sign": sign, "limit_rad": limit}
                for pair in legs
                for sign, limit in zip(pair.signs, pair.limits_rad, strict=True)
            ),
        ],
        "links": [_link_keys(link, radius_m) for link in links],
    }


def _link_keys(link: LinkFigures, radius_m: float) -> dict[str, object]:
    keys: dict[str, object] = {"length_m": round(link.length_m, 12)}
    if not link.mass_kg:
        return keys | {"mass_kg": _NEXT_TO_NOTHING_KG, "radius_m": radius_m, "shape": "none"}
    return keys | {"mass_kg": round(link.mass_kg, 9), "radius_m": round(link.radius_m, 6)}


def _limb_keys(pair: LegPair, scale: float, masses: float) -> dict[str, object]:
    table = dict(pair.table)
    for key in ("hip_m", "foot_radius_m"):
        table[key] = round(scale * float(str(table[key])), 12)
    segments = table["segments_m"]
    assert isinstance(segments, list)
    table["segments_m"] = [round(scale * segment_m, 12) for segment_m in segments]
    table["segment_mass_kg"] = round(masses * float(str(table["segment_mass_kg"])), 9)
    return table


def _plan_limits(
    source: ModelSource, joints: set[str], servo_model: str, notes: list[str]
) -> dict[str, object]:
    keys: dict[str, object] = {}
    efforts = [value for name, value in source.effort_n_m.items() if name in joints]
    speeds = [value for name, value in source.speed_rad_s.items() if name in joints]
    held_n_m = math.inf
    facts = known_model(servo_model)
    if facts is not None and facts.motor is not None:
        held_n_m = round(_HELD_SHARE * facts.motor.stall_torque_n_m, 3)
        keys["torque_limit_n_m"] = held_n_m
    low, high = _TORQUE_N_M
    if efforts and low <= min(efforts) <= high:
        keys["torque_limit_n_m"] = min(*efforts, held_n_m)
        words = f"; a {servo_model} holds {held_n_m:g}" if held_n_m < min(efforts) else ""
        notes.append(f"torque of a plan: the model states {min(efforts):g} N m{words}")
    elif efforts:
        notes.append(
            f"torque of a plan: the model states {min(efforts):g} N m, which no servo has; a "
            f"{servo_model} holds {held_n_m:g}"
        )
    low, high = _PLAUSIBLE_SPEEDS_RAD_S
    if speeds and low <= min(speeds) <= high:
        keys["joint_speed_limit_rad_s"] = min(speeds)
        notes.append(f"joint speed of a plan: {min(speeds):g} rad/s, as the model states")
    elif speeds:
        notes.append(
            f"joint speed of a plan: the model states {min(speeds):g} rad/s, which no servo "
            "has; it is left out"
        )
    return keys


_DEGREES = 4.0 * math.pi, 360.0
"""Half ranges that may be degrees: over two turns in radians, and at most one in degrees (ours)."""


def _joints(
    model: mujoco.MjModel,
    tree: BodyTree,
    directions: ChainDirections,
    reverse: bool,
    notes: list[str],
    assumed: Assumptions,
) -> list[dict[str, object]]:
    """Tables of the spine's joints: axis, sign against the model's, and half range."""
    endless = [hinge.name for hinge in tree.hinges if not model.jnt_limited[hinge.joint]]
    if endless:
        notes.append(
            f"without a range in the model, {_LARGEST_RANGE_RAD:g} rad both ways: "
            + ", ".join(endless)
        )
    tables: list[dict[str, object]] = []
    for hinge, yaw in zip(tree.hinges, directions.yaws, strict=True):
        zero = float(model.qpos0[model.jnt_qposadr[hinge.joint]])
        low, high = (float(v) - zero for v in model.jnt_range[hinge.joint])
        if not model.jnt_limited[hinge.joint]:
            low, high = -_LARGEST_RANGE_RAD, _LARGEST_RANGE_RAD
        half = min(-low, high, _LARGEST_RANGE_RAD)
        key = f"{hinge.name}.limit_rad"
        if _DEGREES[0] < high <= _DEGREES[1]:
            missing = (
                f"joint {hinge.name}: turns to {high:g} rad in the model, {high / math.tau:.3g} "
                f"turns: degrees, or an endless joint (--assume {key}={_LARGEST_RANGE_RAD:g})"
            )
            likely = min(math.radians(high), _LARGEST_RANGE_RAD)
            half = assumed.number(key, 0.05, _LARGEST_RANGE_RAD, missing, likely)
        elif (given := assumed.given(key, 0.05, _LARGEST_RANGE_RAD)) is not None:
            half = given
        elif half <= 0.05:
            raise InputError(
                f"joint {hinge.name}: its range, {low:.3g} to {high:.3g} rad, leaves less than "
                "0.05 rad on one side of straight"
            )
        elif abs(low + high) > 1e-6:
            notes.append(
                f"joint {hinge.name}: turns from {low:.3g} to {high:.3g} rad in the model; the "
                f"robot's file has an even range: {half:.3g} rad both ways"
            )
        elif half < high:
            notes.append(
                f"joint {hinge.name}: its range of {high:.3g} rad is cut to {half:g}: a servo "
                "knows one turn"
            )
        sign = _sign(hinge, yaw, directions, reverse)
        tables.append({"axis": "y" if yaw else "p", "sign": sign, "limit_rad": half})
    return tables


def _sign(hinge: Hinge, yaw: bool, directions: ChainDirections, reverse: bool) -> int:
    """1 if the model's angle counts as ours: the part behind turns about down, or to the left."""
    side = -float(hinge.axis @ directions.up) if yaw else float(hinge.axis @ directions.left)
    return int(math.copysign(1.0, -side if reverse else side))


def _kinematics_error_m(
    model: mujoco.MjModel,
    robot: RobotConfig,
    hinges: list[Hinge],
    directions: ChainDirections,
    scale: float,
    *,
    reverse: bool,
) -> float:
    """Largest distance of the axes of the spine's joints from the model's, over random poses."""
    rng = np.random.default_rng(0)
    data = mujoco.MjData(model)
    signs = np.array(
        [_sign(h, yaw, directions, reverse) for h, yaw in zip(hinges, directions.yaws, strict=True)]
    )
    turn = np.stack([directions.forward, directions.left, directions.up], axis=1)
    limits = np.array(robot.limit_rad[: len(hinges)])
    legs = np.zeros(robot.joint_count - len(hinges))
    worst = 0.0
    for _ in range(_POSES):
        joint_rad = rng.uniform(-limits, limits)
        data.qpos[:] = model.qpos0
        for hinge, angle in zip(hinges, signs * joint_rad, strict=True):
            data.qpos[model.jnt_qposadr[hinge.joint]] += angle
        mujoco.mj_kinematics(model, data)
        # our head where the model's is: its first link has not moved, or the last one of a reverse
        pose = BodyPose(0.0, np.zeros(3), np.eye(3))
        body = body_in_world(robot, pose, np.concatenate([joint_rad, legs]))
        points = chain_points_m(robot, body)[1:-1]
        fixed = 0 if not reverse else len(points) - 1
        model_origin, model_turn = points[fixed], body.rotation[0 if not reverse else -1]
        # seen from the link that the model holds
        model_points = (points - model_origin) @ model_turn
        anchors = np.array([data.xanchor[hinge.joint] for hinge in hinges])
        axes = np.array([data.xaxis[hinge.joint] for hinge in hinges])
        origin = _on_line_m(hinges, directions, fixed)
        file_points = scale * (anchors - origin) @ turn
        axes = axes @ turn
        away = model_points - file_points
        # along its axis it may lie anywhere
        away -= (away * axes).sum(axis=1, keepdims=True) * axes
        worst = max(worst, float(np.linalg.norm(away, axis=1).max()))
    return worst


def _on_line_m(hinges: list[Hinge], directions: ChainDirections, index: int) -> Floats:
    """Where the body's line crosses a joint's axis at zero angles."""
    place = (hinges[index].anchor_m @ directions.forward) * directions.forward
    for yaw, aside in ((True, directions.left), (False, directions.up)):
        some = [
            hinge.anchor_m @ aside
            for hinge, is_yaw in zip(hinges, directions.yaws, strict=True)
            if is_yaw == yaw
        ]
        if some:
            place = place + float(np.median(some)) * aside
    return place
