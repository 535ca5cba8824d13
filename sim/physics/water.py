"""Water: every link is dragged across and along itself, and carried.

Resistive drag, linear and quadratic in the speed, each component by itself (E. Kelasidi,
K. Y. Pettersen, J. T. Gravdahl, P. Liljeback, Modeling of underwater snake robots, ICRA 2014; the
cross-flow principle of G. I. Taylor, Proc. R. Soc. A 214, 1952). Per metre of a body of radius r:

    across: 1/2 rho C_D 2 r (|v_n| + u_n) v_n        along: 1/2 rho C_F pi r (|v_t| + u_t) v_t

``v_n`` is a vector across the link. ``u_n`` and ``u_t`` are the speeds below which the linear part
is the larger one; by default 0: purely quadratic. Drag acts at the two Gauss points of a link's
length, so it also brakes turning links. Added mass is not modelled: MuJoCo's bodies weigh the same
in all directions.
"""

import math

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import Water, WorldConfig

GAUSS = 0.5 / math.sqrt(3.0)
"""Share of a link's length, from its middle."""


def water_constants(world: WorldConfig, robot: RobotConfig) -> Floats:
    """(J + 1, 9) of each link, all zero in a dry world.

    Columns: drag across and along of half the link, kg/m; a Gauss point's arm, radius and surface,
    m; lift of the link under water, N; axis of the link's frame along it. The last two are the
    speeds of the linear parts across and along, m/s. The axis is 0, or 1 for a leg's segment, a rod
    as thick as its foot.
    """
    water = world.ground
    links = robot.joint_count + 1
    rows = np.zeros((links, 9))
    if not isinstance(water, Water):
        return rows
    rods = [*zip(robot.link_lengths_m, robot.link_radii_m, robot.link_masses_kg, strict=True)]
    for joint in robot.limb_joints:
        pair = robot.limbs[joint.pair]
        rods.append((pair.segments_m[joint.place], pair.foot_radius_m, pair.segment_mass_kg))
    for k, (length_m, r, mass_kg) in enumerate(rods):
        half = 0.5 * length_m
        rows[k] = (
            0.5 * water.density_kg_m3 * water.drag_across * 2.0 * r * half,
            0.5 * water.density_kg_m3 * water.drag_along * math.pi * r * half,
            GAUSS * length_m,
            r,
            water.depth_m,
            water.buoyancy * mass_kg * GRAVITY_M_S2,
            float(k >= robot.link_count),
            water.linear_across_m_s,
            water.linear_along_m_s,
        )
    return rows


def immersed(height_m: float, radius_m: float, surface_m: float) -> float:
    """Share of a ball's volume below the surface."""
    x = min(max((surface_m - height_m + radius_m) / (2.0 * radius_m), 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


def floating_height_m(water: Water, radius_m: float) -> float:
    """Height of a floating link's centre: at the surface, or half the depth.

    A body heavier than water lies on the bottom.
    """
    if water.buoyancy < 1.0:
        return radius_m
    if water.buoyancy == 1.0:
        return max(0.5 * water.depth_m, radius_m)
    low, high = -radius_m, radius_m
    for _ in range(60):
        middle = 0.5 * (low + high)
        if water.buoyancy * immersed(middle, radius_m, 0.0) > 1.0:
            low = middle
        else:
            high = middle
    return max(water.depth_m + low, radius_m)


def add_water(
    wrench: Floats,
    centre: Floats,
    rotation: Floats,
    v: Floats,
    w: Floats,
    water: Floats,
    step_s: float,
) -> float:
    """Add drag and lift to the links' wrenches; return the energy lost in the step, J.

    Args:
        wrench: (L, 6) force, and torque about the world's origin; changed.
        centre: (L, 3) of the links.
        rotation: (L, 9) rows of their rotations.
        v: (L, 3) velocity of the centres, world.
        w: (L, 3) spins, world.
        water: (L, 9) ``water_constants``.
        step_s: length of the step.

    """
    lost = 0.0
    for i in range(len(wrench)):
        across = water[i, 0]
        along = water[i, 1]
        arm = water[i, 2]
        radius = water[i, 3]
        surface = water[i, 4]
        lift = water[i, 5]
        wet = immersed(centre[i, 2], radius, surface)
        wrench[i, 2] += wet * lift
        wrench[i, 3] += centre[i, 1] * wet * lift
        wrench[i, 4] -= centre[i, 0] * wet * lift
        axis = int(water[i, 6])
        e0, e1, e2 = rotation[i, axis], rotation[i, 3 + axis], rotation[i, 6 + axis]
        for side in (-1.0, 1.0):
            r0, r1, r2 = side * arm * e0, side * arm * e1, side * arm * e2
            s0 = v[i, 0] + w[i, 1] * r2 - w[i, 2] * r1
            s1 = v[i, 1] + w[i, 2] * r0 - w[i, 0] * r2
            s2 = v[i, 2] + w[i, 0] * r1 - w[i, 1] * r0
            slide = s0 * e0 + s1 * e1 + s2 * e2
            n0, n1, n2 = s0 - slide * e0, s1 - slide * e1, s2 - slide * e2
            d_n = -wet * across * (math.sqrt(n0 * n0 + n1 * n1 + n2 * n2) + water[i, 7])
            d_t = -wet * along * (abs(slide) + water[i, 8]) * slide
            f0, f1, f2 = d_n * n0 + d_t * e0, d_n * n1 + d_t * e1, d_n * n2 + d_t * e2
            lost -= (f0 * s0 + f1 * s1 + f2 * s2) * step_s
            p0, p1, p2 = centre[i, 0] + r0, centre[i, 1] + r1, centre[i, 2] + r2
            wrench[i, 0] += f0
            wrench[i, 1] += f1
            wrench[i, 2] += f2
            wrench[i, 3] += p1 * f2 - p2 * f1
            wrench[i, 4] += p2 * f0 - p0 * f2
            wrench[i, 5] += p0 * f1 - p1 * f0
    return lost
