"""The robot and its ground as a MuJoCo model.

MuJoCo's order of bodies and joints is ours: the head floats, then links, then legs. A leg touches
the ground only with its foot, a ball with MuJoCo's own friction. A link touches it with its belly:
a capsule, a ball, or two capsules as rails. On a height field each capsule becomes balls with
tangent planes (``sim.physics.tangent_planes``). Belly contacts are frictionless (``condim`` 1);
``sim.physics.friction`` adds friction. Links that are not neighbours touch each other without
friction.
"""

import math
import re
from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import LimbsConfig, RobotConfig
from snakewalk.config.world import FlatGround, WaterGround, WorldConfig
from snakewalk.sim.physics.obstacles import obstacle_mjcf
from snakewalk.sim.physics.tangent_planes import AWAY_M, PLANES

STOP_MARGIN_RAD = 0.1
"""Distance of the mechanical stop beyond the limit that a plan may use."""
NOTCH = 0.6
"""Largest gap between a capsule and a straight joint, in radii: the notch is a fifth of one
deep."""
CONTACT_TIME_S = 0.015
"""Time constant of the contact spring; MuJoCo needs at least two steps. Sinks 0.03 mm under the
body's weight."""

_NO_SAME_FRAME = 0
"""Value of ``mjSAMEFRAME_NONE``; MuJoCo 3.2.0 has no name for it in Python."""
GEAR_IMPEDANCE = "0.999 0.999"
"""Impedance of friction in the gears: a joint that it holds creeps at a thousandth of its free
acceleration times the step."""


def build_model(
    robot: RobotConfig,
    world: WorldConfig,
    ground: HeightField | None,
    step_s: float,
) -> mujoco.MjModel:
    """Compile the model; ``ground`` None is the level floor at z = 0.

    Body ``1 + i`` is link i, joint ``1 + j`` is joint j (joint 0 is free), body ``1`` the head.
    """
    text = mjcf(robot, world, ground, step_s, planes=True)
    return finish(mujoco.MjModel.from_xml_string(text), ground)


def _planes(bodies: str, soft: str) -> tuple[str, str]:
    """Geoms and pairs of tangent planes for bellies and feet on a height field."""
    geoms = pairs = ""
    for name, rest in re.findall(r'<geom name="((?:belly|foot)[^"]*)"([^>]*)/>', bodies):
        foot = re.search(r'condim="(\d)".*friction="(\S*)', rest)
        condim, friction = foot.groups() if foot else ("1", "1")
        for k in range(PLANES):
            geoms += (
                f'<geom name="plane{k}_{name}" type="plane" size="1 1 1" pos="0 0 {AWAY_M!r}" '
                'contype="0" conaffinity="0"/>'
            )
            pairs += (
                f'<pair geom1="plane{k}_{name}" geom2="{name}" condim="{condim}" {soft} '
                f'friction="{friction} {friction} 0 0 0"/>'
            )
    return geoms, pairs


def straight_part_m(length_m: float, radius_m: float) -> float:
    """Length of the straight part of a link's capsule belly.

    On a plane a capsule has two contacts, at the ends of this part. At ``length / sqrt(3)`` they
    are the Gauss points of an even load. Slender links have a longer part for shallow notches.
    """
    return max(length_m / math.sqrt(3.0), length_m - 2.0 * NOTCH * radius_m)


def belly_points_m(robot: RobotConfig, link: int) -> Floats:
    """(C, P, 3) centres, relative to a link's, of P balls in each of its C capsules.

    P exceeds 2 only if the notches would be deeper than 0.3 of the radius. C is 0 for a link
    without a belly.
    """
    shape = robot.link_shapes[link]
    radius_m = robot.link_radii_m[link]
    if shape in ("ball", "none"):
        return np.zeros((int(shape == "ball"), 1, 3))
    straight_m = straight_part_m(robot.link_lengths_m[link], radius_m)
    count = 1 + max(1, math.ceil(straight_m / (1.4 * radius_m)))
    row = np.zeros((count, 3))
    row[:, 0] = np.linspace(-0.5, 0.5, count) * straight_m
    if shape == "capsule" or robot.belly.width_m is None:
        return row[None]
    side = np.array([0.0, 0.5 * robot.belly.width_m - radius_m, 0.0])
    return np.stack([row - side, row + side])


def overlapping_links(robot: RobotConfig) -> list[tuple[int, int]]:
    """Pairs of links, not neighbours, that overlap in the straight body.

    Links separated only by links of length zero count as neighbours, at two axes.
    """
    ends = robot.link_ends
    mean_m = robot.mean_link_length_m
    lengths_m = robot.link_lengths_m
    radii_m = robot.link_radii_m
    shapes = robot.link_shapes
    reach_m = [
        radius + (0.0 if shape in ("ball", "none") else 0.5 * straight_part_m(length, radius))
        for length, radius, shape in zip(lengths_m, radii_m, shapes, strict=True)
    ]
    pairs = []
    for i in range(robot.link_count):
        for j in range(i + 2, robot.link_count):
            apart_m = 0.5 * (ends[j] + ends[j + 1] - ends[i] - ends[i + 1]) * mean_m
            if apart_m > reach_m[i] + reach_m[j] and any(lengths_m[i + 1 : j]):
                continue
            pairs.append((i, j))
    return pairs


def load_fault(text: str) -> str | None:
    """Return why the installed MuJoCo cannot load a model, or None."""
    try:
        mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        return f"MuJoCo {mujoco.__version__} cannot load it ({str(error).splitlines()[0]})"
    return None


def finish(model: mujoco.MjModel, ground: HeightField | None) -> mujoco.MjModel:
    """Fill in the elevations and make all links equally soft.

    In MuJoCo a contact is softer if its body moves more easily. The ends of a flat chain would
    carry 0.5 of their weight and the middle 1.5: 14 % of speed under isotropic friction.
    """
    borne = [k for k in range(1, model.nbody) if not _is_between_axes(model, k)]
    model.body_invweight0[1:] = model.body_invweight0[borne].mean(axis=0)
    model.geom_sameframe[model.geom_bodyid == 0] = _NO_SAME_FRAME
    if ground is not None:
        low, span = _levels(ground)
        model.hfield_data[:] = ((ground.z_m - low) / span).astype(np.float32).ravel()
    return model


def _is_between_axes(model: mujoco.MjModel, body: int) -> bool:
    """Whether a body has no length: its joint and the next one coincide."""
    behind = np.flatnonzero(model.body_parentid == body)
    first = body > 1 and bool(model.body_jntnum[body])
    return first and any(not model.body_pos[k].any() for k in behind)


def mjcf(
    robot: RobotConfig,
    world: WorldConfig,
    ground: HeightField | None,
    step_s: float,
    *,
    planes: bool = False,
) -> str:
    """Write the model as MJCF text; ``finish`` fills in a height field's samples.

    With ``planes``, tangent planes replace a height field for bellies and feet.
    """
    soft = f'solref="{max(CONTACT_TIME_S, 2.0 * step_s)} 1" solimp="0.9 0.95 0.001"'
    solver_settings = f'solreffriction="{2.0 * step_s} 1" solimpfriction="{GEAR_IMPEDANCE} 0.001"'
    by_planes = planes and ground is not None
    asset, floor = _ground(world, ground, touches=not by_planes)
    options, obstacle = obstacle_mjcf(world)
    if robot.limbs:
        options = ' cone="elliptic" impratio="10"'  # as for an obstacle: for friction that holds
    overlapping = "".join(
        f'<exclude body1="link{i}" body2="link{j}"/>' for i, j in overlapping_links(robot)
    )
    head = (
        f"{_link(robot, 0, balls=ground is not None)}"
        f"{_links_behind(robot, balls=ground is not None)}{_limbs(robot, 0)}"
    )
    plane_geoms, pairs = _planes(head, soft) if by_planes else ("", "")
    return f"""<mujoco model={quoteattr(robot.name)}>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{step_s!r}" gravity="0 0 {-GRAVITY_M_S2!r}" integrator="Euler" solver="Newton"
    {options}/>
  <asset>{asset}</asset>
  <default>
    <joint type="hinge" {solver_settings}/>
    <geom condim="1" {soft}/>
  </default>
  <worldbody>
    {floor}{obstacle}{plane_geoms}
    <body name="link0"><freejoint name="head"/>
      {head}
    </body>
  </worldbody>
  <contact>{pairs}{overlapping}</contact>
</mujoco>"""


def _ground(world: WorldConfig, ground: HeightField | None, *, touches: bool) -> tuple[str, str]:
    masks = f'name="ground" contype="{int(touches)}" conaffinity="{2 * touches}"'
    if ground is None:
        on = world.ground
        size = on.size_m if isinstance(on, FlatGround | WaterGround) else 10.0
        return "", f'<geom {masks} type="plane" size="{size / 2} {size / 2} 0.1"/>'
    low, span = _levels(ground)
    (w, h), (rows, columns) = ground.size_m, ground.z_m.shape
    asset = (
        f'<hfield name="ground" nrow="{rows}" ncol="{columns}" '
        f'size="{w / 2!r} {h / 2!r} {span!r} 0.1"/>'
    )
    pos = f"{ground.x0_m + w / 2!r} {ground.y0_m + h / 2!r} {low!r}"
    return asset, f'<geom {masks} type="hfield" hfield="ground" pos="{pos}"/>'


def _levels(ground: HeightField) -> tuple[float, float]:
    low = float(ground.z_m.min())
    return low, max(float(ground.z_m.max()) - low, 1e-3)


def _link(robot: RobotConfig, index: int, *, balls: bool) -> str:
    """Inertia of a cylinder; the head's frame is its centre, others' their front joint."""
    m, r = robot.link_masses_kg[index], robot.link_radii_m[index]
    length = robot.link_lengths_m[index]
    centre = f"{0.0 if index == 0 else -length / 2!r} 0 0"
    across = m * (3 * r**2 + length**2) / 12
    mast = 0.0  # its mass is in the link's; here its height adds to the inertia
    if robot.stereo_head is not None and robot.stereo_head.link == index:
        mast = robot.stereo_head.mass_kg * robot.stereo_head.height_m**2
    about = " ".join(
        repr(inertia_kg_m2) for inertia_kg_m2 in (m * r**2 / 2 + mast, across + mast, across)
    )
    return (
        f'<inertial pos="{centre}" mass="{m!r}" diaginertia="{about}"/>'
        f"{_belly(robot, index, balls)}"
    )


def _belly(robot: RobotConfig, index: int, balls: bool) -> str:
    """Write a link's capsules, or the balls in them."""
    common = f'size="{robot.link_radii_m[index]!r}" contype="2" conaffinity="3"'
    text = ""
    for c, row in enumerate(belly_points_m(robot, index)):
        row[:, 0] -= 0.0 if index == 0 else robot.link_lengths_m[index] / 2
        ball_points = [" ".join(repr(float(v)) for v in point) for point in row]
        if balls or len(ball_points) == 1:
            for k, place in enumerate(ball_points):
                text += f'<geom name="belly{index}_{c}_{k}" type="sphere" pos="{place}" {common}/>'
        else:
            ends = f'fromto="{ball_points[0]} {ball_points[-1]}"'
            text += f'<geom name="belly{index}_{c}" type="capsule" {ends} {common}/>'
    return text


def _links_behind(robot: RobotConfig, *, balls: bool) -> str:
    text = ""
    for j in reversed(range(robot.link_count - 1)):
        axis = "0 0 -1" if robot.joint_axes[j] == "y" else "0 1 0"
        stop = robot.limit_rad[j] + STOP_MARGIN_RAD
        back = robot.link_lengths_m[j] / (2.0 if j == 0 else 1.0)
        text = (
            f'<body name="link{j + 1}" pos="{-back!r} 0 0">'
            f'<joint name="{robot.joint_names[j]}" axis="{axis}" range="{-stop!r} {stop!r}" '
            f'armature="{robot.armatures_kg_m2[j]!r}"/>'
            f"{_link(robot, j + 1, balls=balls)}{text}{_limbs(robot, j + 1)}</body>"
        )
    return text


def _limbs(robot: RobotConfig, link: int) -> str:
    """Legs at a link of the spine, after the rest of the spine in MuJoCo's order, depth first."""
    text = ""
    start = robot.link_count
    for pair in robot.limbs:
        count = len(pair.joint_axes)
        if pair.link == link:
            for side in (1.0, -1.0):
                text += _limb(robot, pair, start, side)
                start += count
        else:
            start += 2 * count
    return text


def _limb(robot: RobotConfig, pair: LimbsConfig, first: int, side: float) -> str:
    """One leg, ``side`` 1 to the left; segments are thin rods, the foot a ball at the end."""
    text = ""
    limits = robot.limit_rad
    for k in reversed(range(len(pair.joint_axes))):
        name = robot.joint_names[first + k - 1]
        axis = f"0 0 {-side!r}" if pair.joint_axes[k] == "y" else f"{side!r} 0 0"
        stop = limits[first + k - 1] + STOP_MARGIN_RAD
        along = -0.5 * robot.link_lengths_m[pair.link] if pair.link > 0 else 0.0
        hip = (along, side * pair.hip_m) if k == 0 else (0.0, side * pair.segments_m[k - 1])
        length = pair.segments_m[k]
        mass = pair.segment_mass_kg
        r = pair.foot_radius_m
        across = mass * (3.0 * r**2 + length**2) / 12.0
        foot = (
            f'<geom name="foot{first + k}" type="sphere" size="{r!r}" pos="0 {side * length!r} 0" '
            f'contype="4" conaffinity="1" condim="3" priority="2" '
            f'friction="{pair.foot_friction!r} 0 0"/>'
            if k == len(pair.joint_axes) - 1
            else ""
        )
        text = (
            f'<body name="link{first + k}" pos="{hip[0]!r} {hip[1]!r} 0">'
            f'<joint name="{name}" axis="{axis}" range="{-stop!r} {stop!r}" '
            f'armature="{robot.armatures_kg_m2[first + k - 1]!r}"/>'
            f'<inertial pos="0 {0.5 * side * length!r} 0" mass="{mass!r}" '
            f'diaginertia="{across!r} {mass * r**2 / 2.0!r} {across!r}"/>{foot}{text}</body>'
        )
    return text
