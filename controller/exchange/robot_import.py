"""Other people's robots: a chain of hinges in MJCF or URDF becomes a robot's file.

MuJoCo reads the model; what is taken from it are the joints' axes, order and ranges, and the links'
lengths, masses and radii. Links here are straight, have their joints on one line and their mass
spread evenly about it: what a model has beyond that is refused, or told in a note. Where an anchor
lies along its own axis makes no difference to the motion, so anchors are moved there to the line.
"""

import math
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, Literal

import mujoco
import numpy as np

from snakewalk.config.archive import read_text
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import ConfigError, InputError
from snakewalk.config.loader import checked
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import body_in_world, chain_points_m
from snakewalk.drivers.types import BodyPose

_PARALLEL = 1e-3
"""Radians that an axis may be off its direction, as numbers rounded to 1.571 are (ours)."""
_ASIDE = 1e-3
"""Of the body's length that a joint may be beside the line of the others (ours)."""
_MOST_RAD = 3.05
"""Half range of a joint that may turn for ever: a servo in position mode knows one turn."""
_SPREAD = 0.2
"""Difference of an inertia, and offset of a centre over its link's length, that is told (ours)."""
_NEXT_TO_NOTHING_KG = 2e-4
"""Of what lies between two hinges of one body (ours): physics needs a mass."""
_POSES = 20
_MOST_BYTES, _MOST_PARTS = 20_000_000, 1000
"""Of a model's file; and bodies and joints (ours)."""
_MOST_MEMORY_BYTES, _MOST_CPU_S = 2_000_000_000, 10
"""Of MuJoCo's compiler (ours)."""
_SAID: Final = 3
_COMPILER: Final = f"""
import sys
source, made, memory_bytes, cpu_s = sys.argv[1:]
try:
    import resource
except ImportError:  # Windows
    pass
else:
    for which, most in (("AS", memory_bytes), ("CPU", cpu_s), ("FSIZE", memory_bytes)):
        resource.setrlimit(getattr(resource, "RLIMIT_" + which), (int(most), int(most)))
import mujoco
try:
    mujoco.mj_saveModel(mujoco.MjModel.from_xml_path(source), made, None)
except (ValueError, RuntimeError, MemoryError) as error:
    print(error or type(error).__name__)
    sys.exit({_SAID})
"""


@dataclass(frozen=True, slots=True)
class ImportedRobot:
    """A robot that was read from a model of another program."""

    robot: RobotConfig
    joint_names: tuple[str, ...]
    """As the model has them, head first."""
    notes: tuple[str, ...]
    """What the robot's file cannot say, or what was assumed."""
    kinematics_error_m: float
    """Largest distance of a joint's axis from the model's, in random poses within the ranges."""


@dataclass(frozen=True, slots=True)
class _Hinge:
    name: str
    joint: int
    """In the model."""
    anchor_m: Floats
    axis: Floats


@dataclass(frozen=True, slots=True)
class _Frame:
    """Directions of a straight chain at zero angles."""

    forward: Floats
    left: Floats
    up: Floats


def import_robot(
    path: Path, name: str, servo_model: str, *, scale: float = 1.0, reverse: bool = False
) -> ImportedRobot:
    """Read a chain; its joints get the IDs 1, 2, 3 ... from the head.

    Args:
        path: ``.xml`` (MJCF) or ``.urdf``.
        name: of the robot.
        servo_model: of all joints; a model knows no servos.
        scale: lengths are multiplied by it, masses by its third power.
        reverse: the model's first body is the tail.

    Raises:
        InputError: it is no model, or holds what a robot's file cannot say.

    """
    model = _load(path)
    try:
        return _read(model, name, servo_model, scale, reverse=reverse)
    except ConfigError as error:
        said = error.faults[0]
        raise InputError(
            f"{path}: {said} (--scale: for what is not of the size of servos)"
        ) from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _read(
    model: mujoco.MjModel, name: str, servo_model: str, scale: float, *, reverse: bool
) -> ImportedRobot:
    """``import_robot`` of a model that was loaded."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    notes: list[str] = []
    bodies, hinges = _chain(model, data)
    frame = _frame(hinges, reverse, notes)
    if reverse:
        bodies, hinges = bodies[::-1], hinges[::-1]
    tips, at_m = _places(model, data, bodies, hinges, frame)
    lengths_m = -np.diff([tips[0], *at_m, tips[1]])
    links = [
        _link(model, data, group, frame, at_m, k, float(lengths_m[k]))
        for k, group in enumerate(bodies)
    ]
    notes += _uneven_notes(links)
    endless = [hinge.name for hinge in hinges if not model.jnt_limited[hinge.joint]]
    if endless:
        notes.append(
            f"without a range in the model, {_MOST_RAD:g} rad both ways: {', '.join(endless)}"
        )
    joints = [_joint(model, hinge, frame, reverse=reverse, notes=notes) for hinge in hinges]
    radius_m = max(link.radius_m for link in links)
    keys: dict[str, object] = {
        "name": name,
        "body_radius_m": round(scale * radius_m, 6),
        "servo": {"model": servo_model},
        "joints": joints,
        "links": [
            {
                "length_m": round(scale * link.length_m, 12),
                "mass_kg": round(scale**3 * link.mass_kg, 9),
                "radius_m": round(scale * link.radius_m, 6),
            }
            if link.mass_kg
            else {
                "length_m": round(scale * link.length_m, 12),
                "mass_kg": _NEXT_TO_NOTHING_KG,
                "radius_m": round(scale * radius_m, 6),
                "shape": "none",
            }
            for link in links
        ],
    }
    robot = checked(RobotConfig, keys, name)
    worst_m = _kinematics_error_m(model, robot, hinges, frame, scale, reverse=reverse)
    names = tuple(hinge.name for hinge in hinges)
    return ImportedRobot(robot, names, tuple(notes), worst_m)


def _load(path: Path) -> mujoco.MjModel:
    try:
        text = read_text(path, _MOST_BYTES)
        root = ET.fromstring(text)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    except ET.ParseError as error:
        raise InputError(f"{path}: is no XML: {error}") from None
    if "xacro" in text and any("xacro" in each.tag for each in root.iter()):
        raise InputError(f"{path}: is xacro; write its URDF first: xacro {path.name} > FILE.urdf")
    parts = sum(each.tag in ("body", "link", "joint") for each in root.iter())
    if parts > _MOST_PARTS:
        raise InputError(
            f"{path}: holds {parts} bodies and joints; a chain has at most {_MOST_PARTS}"
        )
    if root.tag not in ("robot", "mujoco"):
        raise InputError(
            f"{path}: begins with <{root.tag}>, not with <mujoco> (MJCF) or <robot> (URDF)"
        )
    with TemporaryDirectory() as folder:
        source, made = path, Path(folder) / "model.mjb"
        if root.tag == "robot":
            source = Path(folder) / "model.urdf"
            source.write_text(_free_urdf(root, path), encoding="utf-8")
        said = _compile(source, made)
        if said is not None:
            raise InputError(f"{path}: MuJoCo cannot read it: {' '.join(said.split())}")
        return mujoco.MjModel.from_binary_path(str(made))


def _compile(source: Path, made: Path) -> str | None:
    """Let MuJoCo compile a model in a process of its own; what it says against it, or None.

    A model may ask for any memory and time, and crash the compiler; that process is limited in all.
    """
    limits = str(_MOST_MEMORY_BYTES), str(_MOST_CPU_S)
    command = [sys.executable, "-c", _COMPILER, str(source), str(made), *limits]
    ended = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    if ended.returncode == _SAID:
        return ended.stdout
    if ended.returncode or not made.is_file():
        return (
            f"its compiler gave up: {_MOST_MEMORY_BYTES / 1e9:g} GB of memory and {_MOST_CPU_S} s "
            "are enough for a robot's model"
        )
    return None


def _free_urdf(root: ET.Element, path: Path) -> str:
    """URDF whose first link floats, without the meshes: MuJoCo bolts it down, and looks for them.

    Raises:
        InputError: a joint mimics another; no link is the first, or several are.

    """
    for joint in root.iter("joint"):
        if joint.find("mimic") is not None:
            raise InputError(
                f"{path}: joint {joint.get('name')} mimics another; each joint here is a servo"
            )
    children = {child.get("link") for child in root.iter("child")}
    first = [link.get("name") for link in root.findall("link") if link.get("name") not in children]
    if len(first) != 1:
        found = ", ".join(map(str, first)) or "each hangs on another"
        raise InputError(f"{path}: one link must be the first, on which all hang: {found}")
    for link in root.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            if shape.find("geometry/mesh") is not None:
                link.remove(shape)
    for old in root.findall("mujoco"):
        root.remove(old)
    options = ET.SubElement(root, "mujoco")
    ET.SubElement(options, "compiler", fusestatic="true", discardvisual="false")
    ET.SubElement(root, "link", name="_ground")
    floating = ET.SubElement(root, "joint", name="_floating", type="floating")
    ET.SubElement(floating, "parent", link="_ground")
    ET.SubElement(floating, "child", link=str(first[0]))
    return ET.tostring(root, encoding="unicode")


def _chain(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[list[list[int]], list[_Hinge]]:
    """Bodies of each link, first body first, and the hinges between them.

    Raises:
        InputError: what moves is not one chain of hinges that is free in the world.

    """
    if model.neq:
        raise InputError(f"{_name(model, 'equality', 0)}: couples joints or closes a loop")
    weld = model.body_weldid
    roots = [b for b in range(1, model.nbody) if weld[b] == b and not weld[model.body_parentid[b]]]
    with_hinges = [root for root in roots if _hinges_behind(model, root)]
    if len(with_hinges) != 1:
        names = ", ".join(_name(model, "body", root) for root in with_hinges) or "none"
        raise InputError(f"one chain of hinges is wanted; free bodies that carry hinges: {names}")
    here = with_hinges[0]
    own = model.jnt_type[model.jnt_bodyid == here]
    slides = (own == mujoco.mjtJoint.mjJNT_FREE) | (own == mujoco.mjtJoint.mjJNT_SLIDE)
    if not slides.any():
        raise InputError(
            f"body {_name(model, 'body', here)}: is bolted to the world; a robot's first body has "
            "a freejoint, or slides"
        )
    links = [[b for b in range(model.nbody) if weld[b] == here]]
    hinges: list[_Hinge] = []
    while True:
        behind = [b for b in range(1, model.nbody) if weld[b] == b != here]
        behind = [b for b in behind if weld[model.body_parentid[b]] == here]
        if not behind:
            return links, hinges
        if len(behind) > 1:
            names = ", ".join(_name(model, "body", b) for b in behind)
            raise InputError(
                f"body {_name(model, 'body', here)}: carries {len(behind)} bodies ({names}); a "
                "chain goes on with one"
            )
        here = behind[0]
        joints = np.flatnonzero(model.jnt_bodyid == here)
        for number, joint in enumerate(joints):
            name = _name(model, "joint", int(joint))
            if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
                kind = mujoco.mjtJoint(model.jnt_type[joint]).name.removeprefix("mjJNT_").lower()
                raise InputError(f"joint {name}: is a {kind} joint; only hinges are servos")
            hinges.append(
                _Hinge(name, int(joint), data.xanchor[joint].copy(), data.xaxis[joint].copy())
            )
            last = number == len(joints) - 1
            links.append([b for b in range(model.nbody) if weld[b] == here] if last else [])


def _hinges_behind(model: mujoco.MjModel, root: int) -> bool:
    """Whether a hinge stands anywhere behind a body."""
    behind = {root}
    for body in range(root + 1, model.nbody):
        if int(model.body_parentid[body]) in behind:
            behind.add(body)
    hinges = model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]
    return any(int(body) in behind - {root} for body in hinges)


def _name(model: mujoco.MjModel, kind: Literal["body", "joint", "equality"], index: int) -> str:
    name: str = getattr(model, kind)(int(index)).name
    return name or f"{kind} {index}"


def _frame(hinges: list[_Hinge], reverse: bool, notes: list[str]) -> _Frame:
    """Directions of the chain: across all axes is along it.

    Raises:
        InputError: an axis lies along the body, or is neither parallel to the first nor across it.

    """
    first = hinges[0].axis
    across: Floats | None = None
    for hinge in hinges[1:]:
        lean = abs(float(hinge.axis @ first))
        if lean > math.cos(_PARALLEL):
            continue
        if lean > math.sin(_PARALLEL) or (
            across is not None and abs(float(hinge.axis @ across)) < math.cos(_PARALLEL)
        ):
            raise InputError(
                f"joint {hinge.name}: its axis is neither parallel to that of {hinges[0].name} nor "
                "at a right angle to it and to the body; joints here yaw or pitch"
            )
        across = hinge.axis if across is None else across
    chord = hinges[0].anchor_m - hinges[-1].anchor_m
    if len(hinges) == 1:
        raise InputError("a chain of one hinge: which way its body lies cannot be told")
    if across is not None:
        forward = np.cross(first, across)
        forward *= math.copysign(1.0, float(forward @ chord))
    else:
        forward = chord - (chord @ first) * first
    size = float(np.linalg.norm(forward))
    if size < 1e-9 or abs(float(forward / size @ chord)) < 1e-9:
        raise InputError(
            f"joint {hinges[0].name}: its axis lies along the body; joints yaw or pitch"
        )
    forward = (-1.0 if reverse else 1.0) * forward / size
    axes = [first] if across is None else [first, across]
    upright = [abs(float(axis[2])) for axis in axes]
    if max(upright) > math.sqrt(0.5) or len(axes) == 2:
        up = axes[int(np.argmax(upright))]
        if max(upright) <= math.sqrt(0.5):
            notes.append(
                f"no axis is vertical in the model: that of {hinges[0].name} is taken as yaw"
            )
            up = axes[0]
        up = up * math.copysign(1.0, float(up[2]) or 1.0)
    elif abs(float(forward[2])) > math.sqrt(0.5):
        notes.append("the body stands upright in the model: its joints are taken as yaw")
        up = first
    else:
        up = np.cross(forward, first)
        up = up * math.copysign(1.0, float(up[2]))
    up = up - (up @ forward) * forward
    up /= np.linalg.norm(up)
    return _Frame(forward, np.cross(up, forward), up)


def _is_yaw(hinge: _Hinge, frame: _Frame) -> bool:
    return abs(float(hinge.axis @ frame.up)) > math.sqrt(0.5)


def _places(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    bodies: list[list[int]],
    hinges: list[_Hinge],
    frame: _Frame,
) -> tuple[tuple[float, float], list[float]]:
    """Head's tip and tail's end, and the joints, along the body, forward.

    Raises:
        InputError: at zero angles the joints are not on one line, in their order.

    """
    at_m = [float(hinge.anchor_m @ frame.forward) for hinge in hinges]
    tips = (
        _tip(model, data, bodies[0], frame.forward, at_m[0]),
        -_tip(model, data, bodies[-1], -frame.forward, -at_m[-1]),
    )
    whole_m = tips[0] - tips[1]
    for yaw, aside in ((True, frame.left), (False, frame.up)):
        some = [hinge for hinge in hinges if _is_yaw(hinge, frame) == yaw]
        offsets_m = [float(hinge.anchor_m @ aside) for hinge in some]
        middle_m = float(np.median(offsets_m)) if some else 0.0
        for hinge, offset_m in zip(some, offsets_m, strict=True):
            if abs(offset_m - middle_m) > _ASIDE * whole_m:
                raise InputError(
                    f"joint {hinge.name}: lies {abs(offset_m - middle_m):.4g} beside the line of "
                    "the others at zero angles; links are straight here, and the chain is at zero"
                )
    for hinge, before, here in zip(hinges[1:], at_m, at_m[1:], strict=False):
        if here > before + 1e-9:
            raise InputError(
                f"joint {hinge.name}: lies {here - before:.4g} ahead of the one before it at zero "
                "angles; the chain must be straight there"
            )
    return tips, [min(at_m[: k + 1]) for k in range(len(at_m))]


def _tip(
    model: mujoco.MjModel, data: mujoco.MjData, group: list[int], ahead: Floats, joint_m: float
) -> float:
    """Where a body at an end of the chain ends, if its mass is spread evenly from its joint on."""
    mass_kg = model.body_mass[group]
    if mass_kg.sum() <= 0.0:
        raise InputError(f"body {_name(model, 'body', group[0])}: has no mass")
    centre = mass_kg @ (data.xipos[group] @ ahead) / mass_kg.sum()
    return joint_m + 2.0 * (float(centre) - joint_m)


def _geoms(model: mujoco.MjModel, group: list[int]) -> list[int]:
    """Geoms of a link that have a size."""
    flat = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
    return [g for g in range(model.ngeom) if model.geom_bodyid[g] in group
            and model.geom_type[g] not in flat]  # fmt: skip


def _support(model: mujoco.MjModel, data: mujoco.MjData, geom: int, ahead: Floats) -> float:
    """How far a geom reaches in a direction."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    centre, turned = float(data.geom_xpos[geom] @ ahead), ahead @ data.geom_xmat[geom].reshape(3, 3)
    along = abs(float(turned[2]))
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return centre + float(size[0])
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return centre + float(size[1]) * along + float(size[0])
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return centre + float(size[1]) * along + float(size[0]) * math.sqrt(max(1 - along**2, 0.0))
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return centre + float(np.linalg.norm(size * turned))
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return centre + float((model.mesh_vert[first : first + count] @ turned).max())
    return centre + float(size @ np.abs(turned))


@dataclass(frozen=True, slots=True)
class _Link:
    length_m: float
    mass_kg: float
    radius_m: float
    offset: float
    """Distance of the centre of mass from the middle over the length."""
    spread: float
    """Inertia across the body over that of an even cylinder."""


def _link(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    group: list[int],
    frame: _Frame,
    at_m: list[float],
    index: int,
    length_m: float,
) -> _Link:
    """One link's figures; of none between two axes of one body, next to nothing."""
    if not group:
        return _Link(length_m if length_m > 1e-6 else 0.0, 0.0, 0.0, 0.0, 1.0)
    masses = model.body_mass[group]
    mass_kg = float(masses.sum())
    if mass_kg <= 0.0:
        raise InputError(f"body {_name(model, 'body', group[0])}: has no mass")
    centre = masses @ data.xipos[group] / mass_kg
    inertia = np.zeros((3, 3))
    for body, mass in zip(group, masses, strict=True):
        turn = data.ximat[body].reshape(3, 3)
        arm = data.xipos[body] - centre
        inertia += turn @ np.diag(model.body_inertia[body]) @ turn.T
        inertia += mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    geoms = _geoms(model, group)
    if geoms:
        widths = [
            sum(max(_support(model, data, g, sign * side) for g in geoms) for sign in (1.0, -1.0))
            for side in (frame.left, frame.up)
        ]
        radius_m = 0.5 * max(widths)
    else:
        radius_m = math.sqrt(2.0 * float(frame.forward @ inertia @ frame.forward) / mass_kg)
    front_m = at_m[index - 1] if index else at_m[0] + length_m
    offset_m = abs(front_m - 0.5 * length_m - float(centre @ frame.forward))
    across = 0.5 * float(frame.left @ inertia @ frame.left + frame.up @ inertia @ frame.up)
    even = mass_kg * (3.0 * radius_m**2 + length_m**2) / 12.0
    if length_m < 1e-6:
        return _Link(0.0, mass_kg, radius_m, 0.0, 1.0)
    return _Link(length_m, mass_kg, radius_m, offset_m / length_m, across / even)


def _uneven_notes(links: list[_Link]) -> list[str]:
    notes = []
    offset = max(link.offset for link in links)
    if offset > 0.01:
        notes.append(
            f"centres of mass are up to {100.0 * offset:.0f} % of their link's length from its "
            "middle; here they are in the middle"
        )
    spread = max((abs(math.log(max(link.spread, 1e-9))), link.spread) for link in links)[1]
    if abs(math.log(max(spread, 1e-9))) > math.log(1.0 + _SPREAD):
        notes.append(
            f"inertia across the body is up to {spread:.2g} times that of an even cylinder, which "
            "it is here"
        )
    return notes


def _joint(
    model: mujoco.MjModel, hinge: _Hinge, frame: _Frame, *, reverse: bool, notes: list[str]
) -> dict[str, object]:
    """Table of a joint: axis, sign against the model's, and half range."""
    yaw = _is_yaw(hinge, frame)
    zero = float(model.qpos0[model.jnt_qposadr[hinge.joint]])
    low, high = (float(v) - zero for v in model.jnt_range[hinge.joint])
    if not model.jnt_limited[hinge.joint]:
        low, high = -_MOST_RAD, _MOST_RAD
    half = min(-low, high, _MOST_RAD)
    if half <= 0.05:
        raise InputError(
            f"joint {hinge.name}: its range, {low:.3g} to {high:.3g} rad, leaves less than 0.05 "
            "rad on one side of straight"
        )
    if abs(low + high) > 1e-6:
        notes.append(
            f"joint {hinge.name}: turns from {low:.3g} to {high:.3g} rad in the model; ranges here "
            f"are even: {half:.3g} rad both ways"
        )
    return {"axis": "y" if yaw else "p", "sign": _sign(hinge, frame, reverse), "limit_rad": half}


def _sign(hinge: _Hinge, frame: _Frame, reverse: bool) -> int:
    """1 where the model's angle counts as ours: what is behind turns about down, or to the left."""
    side = -float(hinge.axis @ frame.up) if _is_yaw(hinge, frame) else hinge.axis @ frame.left
    return int(math.copysign(1.0, -side if reverse else side))


def _kinematics_error_m(
    model: mujoco.MjModel,
    robot: RobotConfig,
    hinges: list[_Hinge],
    frame: _Frame,
    scale: float,
    *,
    reverse: bool,
) -> float:
    """Largest distance of the axes of our joints from the model's, over random poses."""
    rng, data = np.random.default_rng(0), mujoco.MjData(model)
    signs = np.array([_sign(hinge, frame, reverse) for hinge in hinges])
    turn = np.stack([frame.forward, frame.left, frame.up], axis=1)
    limits = np.array(robot.limit_rad)
    worst = 0.0
    for _ in range(_POSES):
        joint_rad = rng.uniform(-limits, limits)
        data.qpos[:] = model.qpos0
        for hinge, angle in zip(hinges, signs * joint_rad, strict=True):
            data.qpos[model.jnt_qposadr[hinge.joint]] += angle
        mujoco.mj_kinematics(model, data)
        # our head where the model's is: its first link has not moved, or the last one of a reverse
        body = body_in_world(robot, BodyPose(0.0, np.zeros(3), np.eye(3)), joint_rad)
        points = chain_points_m(robot, body)[1:-1]
        held = 0 if not reverse else len(points) - 1
        ours_at, ours_turn = points[held], body.rotation[0 if not reverse else -1]
        ours = (points - ours_at) @ ours_turn  # seen from the link that the model holds
        anchors = np.array([data.xanchor[hinge.joint] for hinge in hinges])
        axes = np.array([data.xaxis[hinge.joint] for hinge in hinges])
        origin = _on_line_m(hinges, frame, held)
        theirs, axes = scale * (anchors - origin) @ turn, axes @ turn
        away = ours - theirs
        away -= (away * axes).sum(
            axis=1, keepdims=True
        ) * axes  # along its axis it may lie anywhere
        worst = max(worst, float(np.linalg.norm(away, axis=1).max()))
    return worst


def _on_line_m(hinges: list[_Hinge], frame: _Frame, index: int) -> Floats:
    """Where the body's line crosses a joint's axis at zero angles."""
    place = (hinges[index].anchor_m @ frame.forward) * frame.forward
    for yaw, aside in ((True, frame.left), (False, frame.up)):
        some = [h.anchor_m @ aside for h in hinges if _is_yaw(h, frame) == yaw]
        if some:
            place = place + float(np.median(some)) * aside
    return np.asarray(place)
