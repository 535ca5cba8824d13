"""Three published laws of dry friction with a direction: ``scales``, ``wheels``, ``ellipse``.

For a velocity (a, c) along and across a link, a load N and coefficients mu, the force is

- ``scales``: ``-N (mu_a a, mu_c c) / hypot(a, c)`` (Hu, Nirody, Scott, Shelley, The mechanics of
  slithering locomotion, PNAS 2009);
- ``wheels``: ``-N (mu_a sign a, mu_c sign c)``: Coulomb's law separately on two axes;
- ``ellipse``: ``-N (mu_a^2 a, mu_c^2 c) / hypot(mu_a a, mu_c c)``: maximum dissipation.

They agree if a link slides exactly along or across itself. ``gauges`` is the only place of their
equations: the simulator, its batches on a CPU and the planner's balance call it.
"""

from typing import Any, Literal

import numpy as np

LawName = Literal["scales", "wheels", "ellipse"]
LAWS: tuple[LawName, ...] = ("ellipse", "scales", "wheels")
"""Names of the friction laws; the index of a law is its code in compiled loops."""
ELLIPSE, SCALES, WHEELS = range(3)
Number = Any
"""A float in a loop, an array in a table."""


def gauges(
    law: int, mu_along: Number, mu_across: Number, along_m_s: Number, across_m_s: Number
) -> tuple[Number, Number, Number, Number]:
    """Return shares and gauges (s_a, s_c, g_a, g_c) of the law with a code.

    The force on axis i is ``-N mu_i s_i v_i / g_i``. A caller keeps ``g_i`` above zero near rest.
    Loops call the function with numbers, tables with arrays.
    """
    if law == ELLIPSE:
        u, v = mu_along * along_m_s, mu_across * across_m_s
        gauge = np.sqrt(u * u + v * v)
        return mu_along, mu_across, gauge, gauge
    if law == SCALES:
        speed = np.sqrt(along_m_s * along_m_s + across_m_s * across_m_s)
        return 1.0, 1.0, speed, speed
    return 1.0, 1.0, abs(along_m_s), abs(across_m_s)
