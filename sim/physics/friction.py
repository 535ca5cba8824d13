"""Dry friction with a direction: little along a link, much across it.

``config.friction_law`` has the laws. Sliding backward may have its own coefficient. Near rest each
component is limited to a share of the force that would stop the link within the step, whatever the
law: the drag is passive, and the same along and across.
"""

import math

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.friction_law import gauges

LANES = 8
"""Number of contacts side by side in a table, which the processor handles at once."""
DEPTH, LOAD, STILL, PLACE, SLIDE, NORMAL, AXIS, FORCE, LOSS, SIDEWAYS = (
    LANES * row for row in (0, 2, 3, 4, 7, 10, 13, 16, 19, 20)
)
"""First rows of each quantity in a table of contacts: depth, and the depth of all contacts of the
link; the link's load, and the drag that stops it. Three rows each follow for the contact's place,
its velocity, the ground's normal and the link's axis. ``rub`` writes the force (three rows), its
power, and the speed across times the contact's share of the load. SI units, in the world."""
ROWS = 21 * LANES
"""Numbers of a group of contacts."""

STOP_SHARE = 1.8
"""Share of a contact's momentum that friction may remove in one step; the explicit step is stable
below 2."""
BENT_STOP_SHARE = 1.4
"""The same share for a link that cannot roll: a smaller value is safer, a larger one has no
effect."""


def stop_share(centre_m: Floats, radius_m: float) -> float:
    """Share of a link's momentum that friction may remove in a step, by their centres (L, 3).

    Times mass over step it is the drag that stops the link, N s/m.
    A straight body can also roll, so the effective mass at a contact is a third of the link's (``1
    + r^2 / (r^2 / 2)``, solid cylinder). In a bent body the mean square distance of the links from
    its axis, seen from above, adds to ``r^2 / 2``.
    """
    links = len(centre_m)
    x = y = xx = xy = yy = 0.0
    for i in range(links):
        x += centre_m[i, 0]
        y += centre_m[i, 1]
    x, y = x / links, y / links
    for i in range(links):
        dx, dy = centre_m[i, 0] - x, centre_m[i, 1] - y
        xx += dx * dx
        xy += dx * dy
        yy += dy * dy
    off_axis = (0.5 * (xx + yy) - math.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)) / links
    square = radius_m * radius_m
    lightness = 1.0 + square / (0.5 * square + max(off_axis, 0.0))
    return min(STOP_SHARE / lightness, BENT_STOP_SHARE)


def friction_force(
    normal_n: float,
    along_m_s: float,
    across_m_s: float,
    mu: tuple[float, float, float, float],
    still_n_s_m: float,
    link_normal_n: float,
) -> tuple[float, float]:
    """Force along and across a link at one contact, N.

    ``mu`` is ``FrictionConfig.grip``; ``still_n_s_m`` the drag that stops a link, see
    ``stop_share``; ``link_normal_n`` the sum of the link's normal forces.
    """
    mu_forward, mu_across, mu_back, law = mu
    mu_along = mu_forward if along_m_s >= 0.0 else mu_back
    share_along, share_across, gauge_along, gauge_across = gauges(
        int(law), mu_along, mu_across, along_m_s, across_m_s
    )
    floor = link_normal_n / still_n_s_m
    slow_along = max(gauge_along, mu_along * share_along * floor)
    slow_across = max(gauge_across, mu_across * share_across * floor)
    if normal_n <= 0.0 or slow_along <= 0.0 or slow_across <= 0.0:
        return 0.0, 0.0
    return (
        -normal_n * mu_along * share_along * along_m_s / slow_along,
        -normal_n * mu_across * share_across * across_m_s / slow_across,
    )


def make_lanes(contacts: int) -> tuple[Floats, Ints]:
    """Make a table for a number of contacts, and the link of each."""
    groups = (contacts + LANES - 1) // LANES
    return np.zeros(groups * ROWS), np.zeros(groups * LANES, np.int64)


def rub(table: Floats, contacts: int, mu: tuple[float, float, float, float]) -> None:
    """Write the friction of contacts; those of a link share its load by depth.

    Contact ``k`` has its value of the row at ``ROW`` at ``k // LANES * ROWS + ROW + k % LANES``.
    Places after the last contact become meaningless.
    """
    for group in range((contacts + LANES - 1) // LANES):
        lane = table[group * ROWS : (group + 1) * ROWS]
        for j in range(LANES):
            n0, n1, n2 = lane[NORMAL + j], lane[NORMAL + LANES + j], lane[NORMAL + 2 * LANES + j]
            e0, e1, e2 = lane[AXIS + j], lane[AXIS + LANES + j], lane[AXIS + 2 * LANES + j]
            s0, s1, s2 = lane[SLIDE + j], lane[SLIDE + LANES + j], lane[SLIDE + 2 * LANES + j]
            share = lane[DEPTH + j] / lane[DEPTH + LANES + j]
            lift = e0 * n0 + e1 * n1 + e2 * n2
            e0, e1, e2 = e0 - lift * n0, e1 - lift * n1, e2 - lift * n2
            scale = 1.0 / max(math.sqrt(e0 * e0 + e1 * e1 + e2 * e2), 1e-9)
            e0, e1, e2 = scale * e0, scale * e1, scale * e2
            g0, g1, g2 = n1 * e2 - n2 * e1, n2 * e0 - n0 * e2, n0 * e1 - n1 * e0
            along_m_s = s0 * e0 + s1 * e1 + s2 * e2
            across_m_s = s0 * g0 + s1 * g1 + s2 * g2
            load = lane[LOAD + j]
            along_n, across_n = friction_force(
                share * load, along_m_s, across_m_s, mu, lane[STILL + j], load
            )
            lane[FORCE + j] = along_n * e0 + across_n * g0
            lane[FORCE + LANES + j] = along_n * e1 + across_n * g1
            lane[FORCE + 2 * LANES + j] = along_n * e2 + across_n * g2
            lane[LOSS + j] = along_n * along_m_s + across_n * across_m_s
            lane[SIDEWAYS + j] = abs(across_m_s) * share
