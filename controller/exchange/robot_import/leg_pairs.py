"""Pairs of branches at the spine as legs of a robot file."""

import math
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.exchange.robot_import.body_tree import BodyTree, Branch, Hinge
from snakewalk.controller.exchange.robot_import.chain_directions import ROUNDED_RAD, ChainDirections
from snakewalk.controller.exchange.robot_import.link_figures import LinkFigures

_LEG_TOLERANCE = 0.02
"""Share of a leg's reach that a joint may be off the straight leg (ours)."""
_MOST_JOINTS = 4
_LARGEST_RANGE_RAD = 3.05
_FOOT_M = 0.012
"""Radius of a foot that no shape states: that of a robot file."""


@dataclass(frozen=True, slots=True)
class LegPair:
    """One pair, with its joints left before right and hip before foot."""

    table: dict[str, object]
    """Keys of ``[[limbs]]``."""
    hinges: list[Hinge]
    signs: list[int]
    limits_rad: list[float]


@dataclass(frozen=True, slots=True)
class _Leg:
    axes: str
    hip_m: float
    segments_m: list[float]
    masses_kg: list[float]
    foot_radius_m: float
    foot_friction: float
    signs: list[int]
    limits_rad: list[float]
    ahead_m: float
    """Distance of the leg ahead of its link's middle."""


def leg_pairs(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    tree: BodyTree,
    directions: ChainDirections,
    joints_m: list[float],
    links: list[LinkFigures],
    notes: list[str],
) -> list[LegPair]:
    """Legs from the tail to the head.

    Raises:
        InputError: a leg is not one of a robot file: straight out to the side at zero angles, with
            joints that swing or lift, the mirror image of the other.

    """
    pairs = []
    for link in sorted({branch.link for branch in tree.branches}, reverse=True):
        both = [branch for branch in tree.branches if branch.link == link]
        both.sort(key=lambda branch: -float(branch.hinges[0].anchor_m @ directions.left))
        front_m = joints_m[link - 1] if link else joints_m[0] + links[0].length_m
        middle_m = front_m - 0.5 * links[link].length_m
        legs = [
            _leg(model, data, branch, side, directions, middle_m, tree)
            for branch, side in zip(both, (1.0, -1.0), strict=True)
        ]
        pairs.append(_pair(link, both, legs, tree, notes))
    return pairs


def _leg(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    branch: Branch,
    side: float,
    directions: ChainDirections,
    middle_m: float,
    tree: BodyTree,
) -> _Leg:
    hinges = branch.hinges
    outward = side * directions.left
    if not 1 <= len(hinges) <= _MOST_JOINTS:
        raise InputError(f"leg {branch.name}: has {len(hinges)} joints; a leg has 1 to 4")
    axes = ""
    signs = []
    for hinge in hinges:
        swings = float(hinge.axis @ directions.up)
        lifts = float(hinge.axis @ directions.forward)
        if max(abs(swings), abs(lifts)) < math.cos(ROUNDED_RAD):
            raise InputError(
                f"joint {hinge.name} of leg {branch.name}: its axis is neither upright nor along "
                "the body; joints of a leg swing or lift"
            )
        axes += "y" if abs(swings) > abs(lifts) else "r"
        side_sign = -swings if axes[-1] == "y" else lifts
        signs.append(int(math.copysign(1.0, side * side_sign)))
    spine_left = np.median(
        [float(h.anchor_m @ directions.left) for h in tree.hinges if directions.is_yaw(h.axis)]
        or [0.0]
    )
    spine_up = np.median(
        [float(h.anchor_m @ directions.up) for h in tree.hinges if not directions.is_yaw(h.axis)]
        or [float(hinges[0].anchor_m @ directions.up)]
    )
    out_m = [float(h.anchor_m @ outward) - side * float(spine_left) for h in hinges]
    foot_m, radius_m, friction = _foot(model, data, branch, outward)
    ends_m = [*out_m, foot_m - side * float(spine_left)]
    segments_m = [b - a for a, b in pairwise(ends_m)]
    _check_straight(branch, axes, directions, sum(segments_m), float(spine_up))
    if out_m[0] < 0.0 or min(segments_m) <= 0.002:
        raise InputError(
            f"leg {branch.name}: its joints must stand one outside the other, at least 2 mm apart, "
            "at zero angles"
        )
    limits = []
    for hinge in hinges:
        low, high = (
            float(v - model.qpos0[model.jnt_qposadr[hinge.joint]])
            for v in model.jnt_range[hinge.joint]
        )
        limited = bool(model.jnt_limited[hinge.joint])
        limits.append(min(-low, high, _LARGEST_RANGE_RAD) if limited else _LARGEST_RANGE_RAD)
        if limits[-1] <= 0.05:
            raise InputError(
                f"joint {hinge.name}: its range, {low:.3g} to {high:.3g} rad, leaves less than "
                "0.05 rad on one side of straight"
            )
    masses = [float(model.body_mass[group].sum()) if group else 0.0 for group in branch.groups]
    swings_m = [
        float(hinge.anchor_m @ directions.forward)
        for hinge, axis in zip(hinges, axes, strict=True)
        if axis == "y"
    ]
    ahead_m = float(np.mean(swings_m or [middle_m]))
    return _Leg(
        axes, out_m[0], segments_m, masses, radius_m, friction, signs, limits, ahead_m - middle_m
    )


def _check_straight(
    branch: Branch, axes: str, directions: ChainDirections, reach_m: float, spine_up: float
) -> None:
    """Refuse a leg that is bent at zero angles; an anchor may lie anywhere along its own axis."""
    for axis, aside in (("y", directions.forward), ("r", directions.up)):
        places = [
            (float(h.anchor_m @ aside), h.name)
            for h, kind in zip(branch.hinges, axes, strict=True)
            if kind == axis
        ]
        if not places:
            continue
        middle = spine_up if axis == "r" else places[0][0]
        for place, name in places:
            if abs(place - middle) > _LEG_TOLERANCE * reach_m:
                raise InputError(
                    f"joint {name} of leg {branch.name}: is {abs(place - middle):.3g} m off the "
                    "straight leg at zero angles; a leg must point straight to the side there, at "
                    "the height of the spine"
                )


def _foot(
    model: mujoco.MjModel, data: mujoco.MjData, branch: Branch, outward: Floats
) -> tuple[float, float, float]:
    last = branch.groups[-1]
    geoms = [g for g in range(model.ngeom) if model.geom_bodyid[g] in last]
    balls = [
        g
        for g in geoms
        if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_SPHERE and model.geom_size[g, 0] > 1e-3
    ]
    if balls:
        foot = max(balls, key=lambda g: float(data.geom_xpos[g] @ outward))
        return (
            float(data.geom_xpos[foot] @ outward),
            float(model.geom_size[foot, 0]),
            float(model.geom_friction[foot, 0]),
        )
    hip_m = float(branch.hinges[-1].anchor_m @ outward)
    masses = model.body_mass[last]
    if masses.sum() > 0.0:
        centre = float(masses @ (data.xipos[last] @ outward) / masses.sum())
        if centre > hip_m + 0.001:
            return hip_m + 2.0 * (centre - hip_m), _FOOT_M, 0.8
    raise InputError(
        f"leg {branch.name}: states no foot: a ball at its end, or a centre of mass beyond its "
        "last joint"
    )


def _pair(
    link: int, both: list[Branch], legs: list[_Leg], tree: BodyTree, notes: list[str]
) -> LegPair:
    left, right = legs
    name = tree.names[link]
    is_mirrored = left.axes == right.axes and all(
        abs(a - b) <= _LEG_TOLERANCE * sum(left.segments_m)
        for a, b in zip(
            [left.hip_m, *left.segments_m], [right.hip_m, *right.segments_m], strict=True
        )
    )
    if not is_mirrored:
        raise InputError(
            f"{name}: the legs {both[0].name} and {both[1].name} are not mirror images; correct "
            "the model"
        )
    masses = [*left.masses_kg, *right.masses_kg]
    mean_kg = float(np.mean(masses))
    if max(masses) - min(masses) > 1e-9:
        notes.append(
            f"legs of {name}: segments of {min(masses):.3g} to {max(masses):.3g} kg; the "
            f"robot's file has their mean, {mean_kg:.3g}"
        )
    ahead_m = 0.5 * (left.ahead_m + right.ahead_m)
    if abs(ahead_m) > 1e-6:
        notes.append(
            f"legs of {name}: their hips are {ahead_m:.3g} m ahead of the middle of the link; the "
            "robot's file puts them at the middle"
        )
    table = {
        "link": link,
        "joint_axes": left.axes,
        "hip_m": left.hip_m,
        "segments_m": left.segments_m,
        "segment_mass_kg": mean_kg,
        "foot_radius_m": left.foot_radius_m,
        "foot_friction": min(max(left.foot_friction, 0.01), 3.0),
    }
    return LegPair(
        table,
        [hinge for branch in both for hinge in branch.hinges],
        [*left.signs, *right.signs],
        [*left.limits_rad, *right.limits_rad],
    )
