"""Closed curves across a straight body, for a PDE skin: from its sections, or cut from a mesh.

The body lies along x with its head's tip at 0 and its tail's at ``-length``, y to its left, z up.
A curve begins at the left side and goes over the back.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from snakewalk.config.animal import SkinConfig
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.mesh.body_model import BodyModel
from snakewalk.controller.animals.mesh.mesh import round_tips, tips
from snakewalk.controller.animals.mesh.pde_surface import TURN
from snakewalk.controller.kinematics.arc_length import arc_lengths
from snakewalk.controller.track.resample import SEGMENTS

CURVES = 37
"""Number of curves cut from the dolphin of [GC] Fig. 3."""
AROUND = 32
"""Points of a curve."""
_TIP = 5
"""Curves that round each tip."""
_FIRST_CUT = 0.002
"""Share of the length between the ends of a mesh and its first and last cut."""
_TRIALS = 101
"""Number of planes that separate the body from fins."""


@dataclass(frozen=True, slots=True)
class CrossSections:
    """Curves of a body; a tip is a curve of one place."""

    curves_m: Floats
    """(K, C, 3) points of the curves, m."""
    stations: Floats
    """(K,) places along the body, 0 to 1."""
    length_m: float
    """Length of the body; 1 without a scale."""
    axis_m: float
    """Height of the bending line."""


def skin_model(config: SkinConfig) -> tuple[BodyModel, Floats]:
    """Sections of a shipped skin at 101 places, and how far their middles are lifted (101,)."""
    rows = np.array([[s.at, s.half_width, s.half_height, s.lift] for s in config.sections])
    wide, high, lift = PchipInterpolator(rows[:, 0], rows[:, 1:])(
        np.linspace(0.0, 1.0, SEGMENTS + 1)
    ).T
    return BodyModel(wide, high, None, measured=False), lift


def ellipses(model: BodyModel, lift: Floats | None = None, curves: int = CURVES) -> CrossSections:
    """Sections of a body model as curves, which are closer around the tips.

    ``lift`` (101,) is the height of the middles over the axis, body lengths. None puts every belly
    on the ground, z = 0, and the axis at the height of the highest middle.

    Raises:
        InputError: too few curves to round both tips.

    """
    if curves < 2 * _TIP + 2:
        raise InputError(
            f"curves: a body with round tips needs {2 * _TIP + 2} or more, not {curves}"
        )
    head, tail = tips(model)
    quarter = 1.0 - np.cos(np.linspace(0.0, 0.5 * np.pi, _TIP))
    middle = np.linspace(head, 1.0 - tail, curves - 2 * _TIP + 2)[1:-1]
    s = np.concatenate([head * quarter, middle, 1.0 - tail * quarter[::-1]])
    even = np.linspace(0.0, 1.0, len(model.half_width))
    shrunk = round_tips(model, s)
    wide = np.interp(s, even, model.half_width) * shrunk
    high = np.interp(s, even, model.half_height) * shrunk
    middles = high if lift is None else np.interp(s, even, lift)
    axis = float(model.half_height.max()) if lift is None else 0.0
    turn = np.arange(AROUND) * TURN / AROUND
    rings = np.stack(
        [
            np.repeat(-s[:, None], AROUND, axis=1),
            wide[:, None] * np.cos(turn),
            middles[:, None] + high[:, None] * np.sin(turn),
        ],
        axis=-1,
    )
    size = 1.0 if model.length_m is None else model.length_m
    return CrossSections(rings * size, s, size, axis * size)


def cut(solid: Any, curves: int = CURVES, name: str = "mesh") -> CrossSections:
    """Cut curves from a mesh: its sections at right angles to x ([GC] 2.1).

    A plane may cut several loops: fins, lobes of a tail. The body's loop is the one around the
    middle of the loop before. The cuts begin at the thickest place and end where no loop is left,
    so a forked tail is not a part of the tube. Each half of a loop, over the back and under the
    belly, is divided into equal arcs: left, back, right and belly keep their index in every curve.

    Args:
        solid: ``trimesh.Trimesh`` in the pose above, any unit.
        curves: number, with one place at each end.
        name: of the mesh, for errors.

    Raises:
        InputError: fewer than 4 curves, or no plane in the middle finds a closed loop.

    """
    if curves < 4:
        raise InputError(f"curves: a skin needs 4 or more, not {curves}")
    x = np.asarray(solid.vertices, dtype=float)[:, 0]
    length = float(np.ptp(x))
    trial = np.linspace(_FIRST_CUT, 1.0 - _FIRST_CUT, _TRIALS)
    loops_of_trial = [_section_loops(solid, -s * length) for s in trial]
    sizes = [max((_area(loop) for loop in loops), default=0.0) for loops in loops_of_trial]
    thickest = int(np.argmax(sizes))
    if sizes[thickest] <= 0.0:
        raise InputError(
            f"{name}: no plane across it finds a closed loop: the skin's curves are cut from a "
            "closed body that lies along --forward"
        )
    body = max(loops_of_trial[thickest], key=_area)
    last = _reach(loops_of_trial[thickest:], body) + thickest
    first = thickest - _reach(loops_of_trial[thickest::-1], body)
    # cosine spacing: the sections change fastest near the ends
    even = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, curves))
    s = trial[first] + (trial[last] - trial[first]) * even
    inner = np.clip(s[1:-1], s[0] + 0.02 * np.ptp(s) / curves, s[-1] - 0.02 * np.ptp(s) / curves)
    rings = [
        _ring(_loop_around(_section_loops(solid, -place * length), body), -place * length)
        for place in inner
    ]
    ends = []
    for place, ring in ((s[0], rings[0]), (s[-1], rings[-1])):
        middle = ring.mean(axis=0)
        ends.append(np.repeat([[-place * length, middle[1], middle[2]]], AROUND, axis=0))
    axis = float(np.mean([ring[:, 2].mean() for ring in rings]))
    stations = np.concatenate([s[:1], inner, s[-1:]])
    return CrossSections(np.array([ends[0], *rings, ends[1]]), stations, length, axis)


def _section_loops(solid: Any, x: float) -> list[Floats]:
    """Closed loops (n, 2), y and z, counter-clockwise as seen from the tail, without a last one."""
    path = solid.section(plane_origin=[x, 0.0, 0.0], plane_normal=[1.0, 0.0, 0.0])
    loops = [] if path is None else [np.asarray(loop, dtype=float)[:, 1:] for loop in path.discrete]
    closed = [loop[:-1] for loop in loops if len(loop) > 3 and np.allclose(loop[0], loop[-1])]
    return [loop if _signed_area(loop) > 0.0 else loop[::-1] for loop in closed]


def _reach(loops_of_sections: list[list[Floats]], start: Floats) -> int:
    """How many of these planes in a row cut the body."""
    loop = start
    for k, loops in enumerate(loops_of_sections):
        inside = [enclosing for enclosing in loops if _is_inside_loop(enclosing, loop.mean(axis=0))]
        if not inside:
            return k - 1
        loop = max(inside, key=_area)
    return len(loops_of_sections) - 1


def _loop_around(loops: list[Floats], body: Floats) -> Floats:
    inside = [loop for loop in loops if _is_inside_loop(loop, body.mean(axis=0))]
    return max(inside or loops, key=_area)


def _is_inside_loop(loop: Floats, point: Floats) -> bool:
    """Whether a loop goes around a point."""
    angle = np.arctan2(*(loop - point).T[::-1])
    turned = np.diff(np.unwrap(np.append(angle, angle[0])))
    return bool(abs(turned.sum()) > np.pi)


def _signed_area(loop: Floats) -> float:
    after = np.roll(loop, -1, axis=0)
    return 0.5 * float(np.sum(loop[:, 0] * after[:, 1] - after[:, 0] * loop[:, 1]))


def _area(loop: Floats) -> float:
    return abs(_signed_area(loop))


def _ring(loop: Floats, x: float) -> Floats:
    """(AROUND, 3) one curve."""
    left, right = int(loop[:, 0].argmax()), int(loop[:, 0].argmin())
    back = _arcs(np.roll(loop, -left, axis=0), (right - left) % len(loop))
    belly = _arcs(np.roll(loop, -right, axis=0), (left - right) % len(loop))
    return np.column_stack([np.full(AROUND, x), np.concatenate([back, belly])])


def _arcs(loop: Floats, last: int) -> Floats:
    """(AROUND / 2, 2) equal arcs from the first corner towards corner ``last``, without the end."""
    part = loop[: last + 1]
    arc = arc_lengths(part)
    station = np.linspace(0.0, arc[-1], AROUND // 2 + 1)[:-1]
    return np.stack([np.interp(station, arc, part[:, k]) for k in range(2)], axis=1)
