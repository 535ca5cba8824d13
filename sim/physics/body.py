"""The robot and its ground as a MuJoCo model.

The head link floats, the others hang behind it, so MuJoCo's order of bodies and joints is ours.
Each link meets the ground with one sphere at its centre: on a plane exactly one contact a link.
Contacts are frictionless (``condim`` 1); friction is added by ``sim.physics.friction``, since
MuJoCo's own cone knows no direction along a body. Links do not touch each other.
"""

import mujoco
import numpy as np

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FlatGround, WaterGround, WorldConfig
from snakewalk.sim.physics.obstacles import obstacle_mjcf

GEAR_RATIO = 353.5
"""XM430-W350, e-manual."""
ROTOR_INERTIA_KG_M2 = 3.6e-7
"""Not published by the maker. Chosen so that the reflected inertia is 0.045 kg m^2, the armature
that MuJoCo Menagerie's robotis_op3 carries for its XM430-W350 joints."""
ARMATURE_KG_M2 = ROTOR_INERTIA_KG_M2 * GEAR_RATIO**2
STOP_MARGIN_RAD = 0.1
"""The mechanical stop is this far beyond the limit that a plan may use."""
CONTACT_TIME_S = 0.015
"""Of the contact spring; MuJoCo wants at least two steps. Sinks 0.03 mm under the body's weight."""


def build_model(
    robot: RobotConfig,
    world: WorldConfig,
    ground: HeightField | None,
    step_s: float,
) -> mujoco.MjModel:
    """Compile the model; ``ground`` None is the level floor at z = 0.

    Body ``1 + i`` is link i, joint ``1 + j`` is joint j (joint 0 is free), body ``1`` the head.
    """
    spec = mujoco.MjSpec.from_string(mjcf(robot, world, ground, step_s))
    return finish(spec.compile(), ground)


def finish(model: mujoco.MjModel, ground: HeightField | None) -> mujoco.MjModel:
    """Fill in the elevations, which the text leaves out, and make all links equally soft.

    MuJoCo makes a contact the softer the easier its body moves: of a chain that lies flat the ends
    would carry half and the middle one and a half times their weight. That alone moves the speed
    under isotropic friction by 14 %.
    """
    model.body_invweight0[1:] = model.body_invweight0[1:].mean(axis=0)
    if ground is not None:
        low, span = _levels(ground)
        model.hfield_data[:] = ((ground.z_m - low) / span).astype(np.float32).ravel()
    return model


def mjcf(
    robot: RobotConfig,
    world: WorldConfig,
    ground: HeightField | None,
    step_s: float,
) -> str:
    """Write the model as MJCF text (a height field's samples are filled in by ``finish``)."""
    soft = f'solref="{max(CONTACT_TIME_S, 2.0 * step_s)} 1" solimp="0.9 0.95 0.001"'
    asset, floor = _ground(world, ground)
    options, obstacle = obstacle_mjcf(world)
    return f"""<mujoco model="{robot.name}">
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{step_s!r}" gravity="0 0 {-GRAVITY_M_S2!r}" integrator="Euler" solver="Newton"
    {options}/>
  <asset>{asset}</asset>
  <default>
    <joint type="hinge" armature="{ARMATURE_KG_M2!r}"/>
    <geom condim="1" {soft}/>
  </default>
  <worldbody>
    {floor}{obstacle}
    <body name="link0"><freejoint name="head"/>
      {_link(robot, 0)}
      {_links_behind(robot)}
    </body>
  </worldbody>
</mujoco>"""


def _ground(world: WorldConfig, ground: HeightField | None) -> tuple[str, str]:
    masks = 'name="ground" contype="1" conaffinity="2"'
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


def _link(robot: RobotConfig, index: int) -> str:
    """Inertia of a cylinder; the frame of the head is its centre, of others their front joint."""
    m, r, length = robot.link_mass_kg, robot.body_radius_m, robot.link_length_m
    centre = f"{0.0 if index == 0 else -length / 2!r} 0 0"
    across = m * (3 * r**2 + length**2) / 12
    return (
        f'<inertial pos="{centre}" mass="{m!r}" diaginertia="{m * r**2 / 2!r} {across!r} '
        f'{across!r}"/><geom name="belly{index}" type="sphere" size="{r!r}" pos="{centre}" '
        'contype="2" conaffinity="1"/>'
    )


def _links_behind(robot: RobotConfig) -> str:
    text = ""
    for j in reversed(range(robot.joint_count)):
        axis = "0 0 -1" if robot.joint_axes[j] == "y" else "0 1 0"
        stop = robot.limit_rad[j] + STOP_MARGIN_RAD
        back = robot.link_length_m / (2.0 if j == 0 else 1.0)
        text = (
            f'<body name="link{j + 1}" pos="{-back!r} 0 0">'
            f'<joint name="joint{j}" axis="{axis}" range="{-stop!r} {stop!r}"/>'
            f"{_link(robot, j + 1)}{text}</body>"
        )
    return text
