"""The tree of a model's moving bodies: which of them are the spine, legs and passive wheels."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.exchange.robot_import.model_source import ModelSource

_ON_AXIS = 0.2
"""Distance of a wheel's centre of mass from its axis over its distance from the link's (ours)."""


_STRAIGHT_SHARE = 0.9
"""Distance of a spine's ends over the way along its joints (ours)."""


@dataclass(frozen=True, slots=True)
class Hinge:
    """A joint at zero angles."""

    name: str
    joint: int
    """Number of the joint in the model."""
    anchor_m: Floats
    axis: Floats


@dataclass(slots=True)
class MovingBody:
    """Bodies that move as one, and the hinges by which they hang on their parent."""

    name: str
    bodies: list[int]
    """Numbers of the bodies in the model; empty between two hinges of one body."""
    hinges: list[Hinge] = field(default_factory=list)
    parent: "MovingBody | None" = None
    children: list["MovingBody"] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Branch:
    """A chain of bodies that hangs on a link of the spine."""

    link: int
    """Index along the spine; 0 is the first body."""
    hinges: list[Hinge]
    groups: list[list[int]]
    """Bodies behind each hinge."""
    name: str


@dataclass(frozen=True, slots=True)
class BodyTree:
    """The spine and its branches, first body first."""

    groups: list[list[int]]
    """Bodies of each link of the spine."""
    names: list[str]
    hinges: list[Hinge]
    branches: list[Branch]
    wheels: list[list[int]]
    """Bodies of passive wheels, which are also in ``groups``."""


def element_name(
    model: mujoco.MjModel, kind: Literal["body", "joint", "equality"], index: int
) -> str:
    """Name in the model, or its kind and number."""
    name: str = getattr(model, kind)(int(index)).name
    return name or f"{kind} {index}"


def body_tree(model: mujoco.MjModel, data: mujoco.MjData, source: ModelSource) -> BodyTree:
    """Find the spine of a model that stands at zero angles.

    Raises:
        InputError: the moving bodies are not one chain of hinges that is free in the world, with
            nothing but pairs of legs and passive wheels at its sides.

    """
    if model.neq:
        name = element_name(model, "equality", 0)
        raise InputError(
            f"{name}: couples joints or closes a loop; each joint of a robot's file is a servo"
        )
    root = _root(model, data)
    for body in _walk(root):
        body.name = source.part_names.get(body.name, body.name)
    wheels = _take_wheels(model, data, root, source)
    spine = _spine(root)
    return _with_branches(spine, wheels)


def _root(model: mujoco.MjModel, data: mujoco.MjData) -> MovingBody:
    """First body of the only free tree that has hinges."""
    weld = model.body_weldid
    roots = [b for b in range(1, model.nbody) if weld[b] == b and not weld[model.body_parentid[b]]]
    with_hinges = [root for root in roots if _hinges_behind(model, root)]
    if len(with_hinges) != 1:
        names = ", ".join(element_name(model, "body", root) for root in with_hinges) or "none"
        raise InputError(
            f"a robot is one free chain of hinges; free bodies that carry hinges: {names}"
        )
    first = with_hinges[0]
    joint_types = model.jnt_type[model.jnt_bodyid == first]
    slides = (joint_types == mujoco.mjtJoint.mjJNT_FREE) | (
        joint_types == mujoco.mjtJoint.mjJNT_SLIDE
    )
    if not slides.any():
        raise InputError(
            f"body {element_name(model, 'body', first)}: is bolted to the world; a robot's first "
            "body has a freejoint, or slides"
        )
    moving_bodies = {
        first: MovingBody(element_name(model, "body", first), _welded_bodies(model, first))
    }
    for body in range(first + 1, model.nbody):
        above = int(weld[model.body_parentid[body]])
        if weld[body] != body or above not in moving_bodies:
            continue
        moving_body = MovingBody(element_name(model, "body", body), _welded_bodies(model, body))
        moving_body.parent, moving_body.hinges = moving_bodies[above], _hinges(model, data, body)
        moving_bodies[above].children.append(moving_body)
        moving_bodies[body] = moving_body
    return moving_bodies[first]


def _welded_bodies(model: mujoco.MjModel, body: int) -> list[int]:
    return [int(b) for b in np.flatnonzero(model.body_weldid == body)]


def _hinges_behind(model: mujoco.MjModel, root: int) -> bool:
    behind = {root}
    for body in range(root + 1, model.nbody):
        if model.body_parentid[body] in behind:
            behind.add(body)
    hinges = model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]
    return any(int(body) in behind - {root} for body in hinges)


def _hinges(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> list[Hinge]:
    hinges = []
    for joint in np.flatnonzero(model.jnt_bodyid == body):
        name = element_name(model, "joint", int(joint))
        if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
            kind = mujoco.mjtJoint(model.jnt_type[joint]).name.removeprefix("mjJNT_").lower()
            raise InputError(f"joint {name}: is a {kind} joint; only hinges are servos")
        hinges.append(Hinge(name, int(joint), data.xanchor[joint].copy(), data.xaxis[joint].copy()))
    return hinges


def _take_wheels(
    model: mujoco.MjModel, data: mujoco.MjData, root: MovingBody, source: ModelSource
) -> list[list[int]]:
    """Merge passive wheels into the bodies that carry them."""

    def turns_freely(body: MovingBody) -> bool:
        if body.children or len(body.hinges) != 1 or body.parent is None:
            return False
        hinge = body.hinges[0]
        if model.jnt_limited[hinge.joint] or hinge.name in (source.actuated or ()):
            return False
        centre = centre_m(model, data, body.bodies) - hinge.anchor_m
        carrier = centre_m(model, data, body.parent.bodies) - hinge.anchor_m
        off = float(np.linalg.norm(centre - (centre @ hinge.axis) * hinge.axis))
        return off <= max(_ON_AXIS * float(np.linalg.norm(carrier)), 1e-6)

    candidates = [body for body in _walk(root) if turns_freely(body)]
    side_by_side = [
        body for body in candidates if body.parent is not None and len(body.parent.children) > 1
    ]
    masses = {round(float(model.body_mass[body.bodies].sum()), 9) for body in side_by_side}
    wheels = [
        body
        for body in candidates
        if body in side_by_side or round(float(model.body_mass[body.bodies].sum()), 9) in masses
    ]
    if not any(body not in wheels for body in _walk(root) if body is not root):
        return []
    for wheel in wheels:
        assert wheel.parent is not None
        wheel.parent.children.remove(wheel)
        wheel.parent.bodies += wheel.bodies
    return [wheel.bodies for wheel in wheels]


def centre_m(model: mujoco.MjModel, data: mujoco.MjData, bodies: list[int]) -> Floats:
    """Centre of mass of some bodies; their mean place if they have no mass."""
    masses = model.body_mass[bodies]
    total = float(masses.sum())
    if total <= 0.0:
        return np.asarray(data.xpos[bodies].mean(axis=0))
    return np.asarray(masses @ data.xipos[bodies] / total)


def _walk(body: MovingBody) -> Iterator[MovingBody]:
    stack = [body]
    while stack:
        moving_body = stack.pop()
        yield moving_body
        stack += reversed(moving_body.children)


def _spine(root: MovingBody) -> list[MovingBody]:
    """Path from the root whose branches are pairs: a straight one, of these that with most hinges.

    It may end at a body with a pair of legs.
    """
    paths = []
    for end in _walk(root):
        path = [end]
        while path[-1].parent is not None:
            path.append(path[-1].parent)
        paths.append(path[::-1])
    paths.sort(key=lambda path: (not _is_straight_path(path), -sum(len(b.hinges) for b in path)))
    for path in paths:
        if len(path) > 1 and all(
            _is_pair(_bodies_off_path(branch_body, path)) for branch_body in path
        ):
            return path
    fork = next((body for body in _walk(root) if not _is_pair(body.children[1:])), root)
    names = ", ".join(child.name for child in fork.children)
    raise InputError(
        f"body {fork.name}: carries {len(fork.children)} bodies ({names}); a chain goes on with "
        "one, besides a pair of legs, alike on both sides, and passive wheels"
    )


def _is_straight_path(path: list[MovingBody]) -> bool:
    """Whether the joints of a path lie on about one line."""
    anchors = [hinge.anchor_m for body in path for hinge in body.hinges]
    steps = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(anchors))
    return steps == 0.0 or float(np.linalg.norm(anchors[-1] - anchors[0])) > _STRAIGHT_SHARE * steps


def _bodies_off_path(body: MovingBody, path: list[MovingBody]) -> list[MovingBody]:
    return [child for child in body.children if child not in path]


def _is_pair(children: list[MovingBody]) -> bool:
    """Whether bodies differ from a pair of legs: not two, or unequal numbers of hinges."""
    if not children:
        return True
    if len(children) != 2:
        return False
    counts = []
    for child in children:
        if any(len(body.children) > 1 for body in _walk(child)):
            return False
        counts.append([len(body.hinges) for body in _walk(child)])
    return counts[0] == counts[1]


def _with_branches(path: list[MovingBody], wheels: list[list[int]]) -> BodyTree:
    groups = [path[0].bodies]
    names = [path[0].name]
    hinges = []
    number = {id(path[0]): 0}
    for before, body in pairwise(path):
        for k, hinge in enumerate(body.hinges):
            hinges.append(hinge)
            last = k == len(body.hinges) - 1
            groups.append(body.bodies if last else [])
            names.append(body.name if last else f"{body.name}, between its hinges")
        if not body.hinges:  # cannot be: it would be welded to the one before
            raise InputError(f"body {body.name}: has no joint to {before.name}")
        number[id(body)] = len(groups) - 1
    branches = []
    for body in path:
        for child in _bodies_off_path(body, path):
            chain = list(_walk(child))
            branches.append(
                Branch(
                    number[id(body)],
                    [hinge for chain_body in chain for hinge in chain_body.hinges],
                    [
                        chain_body.bodies if k == len(chain_body.hinges) - 1 else []
                        for chain_body in chain
                        for k in range(len(chain_body.hinges))
                    ],
                    child.name,
                )
            )
    return BodyTree(groups, names, hinges, branches, wheels)
