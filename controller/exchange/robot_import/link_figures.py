"""Lengths, masses and radii of a chain's links, and where each of them comes from."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import Assumptions, InputError
from snakewalk.controller.exchange.robot_import.body_tree import BodyTree
from snakewalk.controller.exchange.robot_import.chain_directions import ChainDirections
from snakewalk.controller.exchange.robot_import.model_source import ModelSource

_LINE_TOLERANCE = 1e-3
"""Share of the body's length that a joint may be off the line of the others (ours)."""
_SHORTEST_LINK_M = 0.005
"""Length of a link that a robot file accepts."""
_SHAPE_TOLERANCE = 2e-3
"""Difference of two links' shapes, over their length, that counts as the same shape (ours)."""
_LENGTH_TOLERANCE = 1e-6
"""Difference of two lengths that a cylinder's centre and inertia state (ours)."""
_SPREAD = 0.2
"""Difference of an inertia that is reported (ours)."""
_POINT = 1e-3
"""Below this, the inertia is that of a point, which stands for a missing shape (ours)."""
_THINNEST = 0.05
_THICKEST = 1.0
"""Radius over length of a mean link: an inertia that asks for another is a placeholder (ours)."""
_ASSUMED_RADIUS = 0.4
"""Radius over length of links without a stated thickness (ours)."""


@dataclass(frozen=True, slots=True)
class LinkFigures:
    """One link; lengths in the model's unit."""

    length_m: float
    mass_kg: float
    """Mass of the link; 0 between two hinges of one body."""
    radius_m: float
    offset: float
    """Distance of the centre of mass from the middle over the length."""
    spread: float
    """Inertia across the body, divided by an even cylinder's."""


@dataclass(frozen=True, slots=True)
class _Mass:
    kg: float
    centre: Floats
    inertia: Floats


class ChainFigures:
    """Measures the links of a chain that lies straight, head first."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        tree: BodyTree,
        directions: ChainDirections,
        source: ModelSource,
        assumed: Assumptions,
    ) -> None:
        self._model = model
        self._data = data
        self._tree = tree
        self._directions = directions
        self._assumed = assumed
        self.notes: list[str] = []
        wheels = {body for group in tree.wheels for body in group}
        self._solid = [
            self._geoms([body for body in group if body not in wheels], source)
            for group in tree.groups
        ]
        self.joints_m = self._joints_m()
        self._masses = [self._mass(k, source) for k in range(len(tree.groups))]
        self.links = self._links()

    def wheel_friction(self, source: ModelSource) -> list[float]:
        """Sliding friction that the model states of its wheels."""
        bodies = {body for group in self._tree.wheels for body in group}
        if source.friction is not None:
            names = {self._model.body(body).name for body in bodies}
            return sorted({source.friction[name] for name in names if name in source.friction})
        return sorted(
            {
                float(self._model.geom_friction[g, 0])
                for g in range(self._model.ngeom)
                if self._model.geom_bodyid[g] in bodies
            }
        )

    def _joints_m(self) -> list[float]:
        """Where the hinges are along the body, forward.

        Raises:
            InputError: at zero angles they are not on one line, in their order.

        """
        directions = self._directions
        hinges = self._tree.hinges
        at_m = [float(hinge.anchor_m @ directions.forward) for hinge in hinges]
        span_m = at_m[0] - at_m[-1]
        worst_m = 0.0
        for yaw, aside in ((True, directions.left), (False, directions.up)):
            some = [h for h, is_yaw in zip(hinges, directions.yaws, strict=True) if is_yaw == yaw]
            offsets_m = [float(hinge.anchor_m @ aside) for hinge in some]
            middle_m = float(np.median(offsets_m)) if some else 0.0
            for hinge, offset_m in zip(some, offsets_m, strict=True):
                off_m = abs(offset_m - middle_m)
                worst_m = max(worst_m, off_m)
                if off_m > max(_LINE_TOLERANCE, 0.05 / len(hinges)) * span_m:
                    raise InputError(
                        f"joint {hinge.name}: lies {off_m:.4g} m from the line of the others at "
                        "zero angles; a chain needs straight links, straight at zero angles"
                    )
        if worst_m > _LINE_TOLERANCE * span_m:
            self.notes.append(
                f"joints lie up to {worst_m:.2g} m from one line at zero angles; the robot's "
                "file puts them on the line"
            )
        for hinge, before, ahead_m in zip(hinges[1:], at_m, at_m[1:], strict=False):
            if ahead_m > before + 1e-9:
                raise InputError(
                    f"joint {hinge.name}: lies {ahead_m - before:.4g} m ahead of the one before it "
                    "at zero angles; the chain must be straight there"
                )
        return [min(at_m[: k + 1]) for k in range(len(at_m))]

    def _links(self) -> list[LinkFigures]:
        inner_m = [-float(step) for step in np.diff(self.joints_m)]
        lengths_m = [0.0, *(length if length > 1e-6 else 0.0 for length in inner_m), 0.0]
        known_links = [k for k in range(1, len(lengths_m) - 1) if lengths_m[k] > _SHORTEST_LINK_M]
        last = len(lengths_m) - 1
        ends = {k: self._end_m(k, lengths_m, known_links) for k in (0, last)}
        for k, (length_m, why) in ends.items():
            lengths_m[k] = length_m
            end = "head" if k == 0 else "tail"
            self.notes.append(f"{end} {self._tree.names[k]}: {length_m:.4g} m long, {why}")
        for k, length_m in enumerate(lengths_m):
            if 0.0 < length_m <= _SHORTEST_LINK_M:
                raise InputError(
                    f"{self._tree.names[k]}: is {length_m:.3g} m long; a link is longer than "
                    f"{_SHORTEST_LINK_M:g} m, or has no length: --scale enlarges"
                )
        radii_m = self._radii_m(lengths_m)
        return [self._link(k, lengths_m[k], radii_m[k]) for k in range(last + 1)]

    def _end_m(self, k: int, lengths_m: list[float], known_links: list[int]) -> tuple[float, str]:
        """Length of the head or the tail, and what states it."""
        name = self._tree.names[k]
        key = f"{name}.length_m"
        given = self._assumed.given(key, _SHORTEST_LINK_M, 100.0)
        if given is not None:
            return given, "by option"
        sign = 1.0 if k == 0 else -1.0
        joint_m = self.joints_m[0] if k == 0 else self.joints_m[-1]
        even_m = self._even_length_m(k, sign, joint_m)
        if even_m is not None:
            return even_m, "as its centre of mass and inertia state (an even cylinder)"
        reach_m = self._reach_m(k, sign, joint_m)
        if reach_m is not None and reach_m > _SHORTEST_LINK_M:
            for other in sorted(known_links, key=lambda link: abs(link - k)):
                other_joint_m = self.joints_m[other] if k == 0 else self.joints_m[other - 1]
                other_reach_m = self._reach_m(other, sign, other_joint_m)
                if (
                    other_reach_m is None
                    or abs(other_reach_m - reach_m) > _SHAPE_TOLERANCE * reach_m
                ):
                    continue
                beyond_m = lengths_m[other] - other_reach_m
                if abs(beyond_m) < 1e-9:
                    break
                return (
                    reach_m + beyond_m,
                    f"its shape is that of {self._tree.names[other]} (its shape alone reaches "
                    f"{reach_m:.4g} m)",
                )
            return reach_m, "as far as its shape reaches"
        if known_links:
            nearest = min(known_links, key=lambda known_link: abs(known_link - k))
            return (
                lengths_m[nearest],
                f"as its neighbour {self._tree.names[nearest]}: it has no shape of its own",
            )
        centre_m = 2.0 * sign * (float(self._masses[k].centre @ self._directions.forward) - joint_m)
        if centre_m > _SHORTEST_LINK_M:
            return centre_m, "twice the distance of its centre of mass from its joint"
        length_m = self._assumed.number(
            key,
            _SHORTEST_LINK_M,
            100.0,
            f"link {name}: states no length: it has no shape, no neighbour with a length, and its "
            "centre of mass is at its joint",
            likely=0.07,
        )
        return length_m, "by option"

    def _even_length_m(self, k: int, sign: float, joint_m: float) -> float | None:
        """Length of an even cylinder, if mass centre and inertia state the same one."""
        mass = self._masses[k]
        directions = self._directions
        if mass.kg <= 0.0:
            return None
        length_m = 2.0 * sign * (float(mass.centre @ directions.forward) - joint_m)
        along = float(directions.forward @ mass.inertia @ directions.forward)
        across = float(directions.left @ mass.inertia @ directions.left)
        square = 12.0 * (across - 0.5 * along) / mass.kg
        if length_m <= _SHORTEST_LINK_M or square <= 0.0:
            return None
        return (
            length_m if abs(math.sqrt(square) - length_m) <= _LENGTH_TOLERANCE * length_m else None
        )

    def _reach_m(self, k: int, sign: float, joint_m: float) -> float | None:
        """How far a link's shape reaches from a joint, forward (1) or back (-1)."""
        if not self._solid[k]:
            return None
        ahead = sign * self._directions.forward
        furthest_m = max(_support(self._model, self._data, g, ahead) for g in self._solid[k])
        return furthest_m - sign * joint_m

    def _geoms(self, group: list[int], source: ModelSource) -> list[int]:
        """Geoms of a link that have a size: those with mass, else those that are only drawn."""
        model = self._model
        flat = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
        geom_indices = [
            g
            for g in range(model.ngeom)
            if model.geom_bodyid[g] in group
            and model.geom_type[g] not in flat
            and float(model.geom_rbound[g]) > 2e-4
        ]
        solid = [g for g in geom_indices if model.geom(g).name not in source.massless_geoms]
        return solid or geom_indices

    def _mass(self, k: int, source: ModelSource) -> _Mass:
        """Mass of a link about its centre; the zero mass between two hinges of one body.

        Raises:
            InputError: nothing states it (the question).

        """
        model = self._model
        group = self._tree.groups[k]
        name = self._tree.names[k]
        if not group:
            return _Mass(0.0, np.zeros(3), np.zeros((3, 3)))
        masses = model.body_mass[group]
        kg = float(masses.sum())
        if source.stated_mass_kg is not None:
            names = [model.body(body).name for body in group]
            kg = sum(source.stated_mass_kg.get(body_name, 0.0) for body_name in names)
        if kg <= 0.0:
            ends = k in (0, len(self._tree.groups) - 1)
            here_m = [*self.joints_m[max(k - 1, 0) : k + 1]]
            if not ends and abs(here_m[0] - here_m[-1]) < 1e-6:
                return _Mass(0.0, np.zeros(3), np.zeros((3, 3)))
            others = [
                source.stated_mass_kg.get(model.body(group_bodies[0]).name, 0.0)
                for group_bodies in self._tree.groups
                if group_bodies and source.stated_mass_kg is not None
            ]
            likely = float(np.median([mass_kg for mass_kg in others if mass_kg > 0.0] or [0.1]))
            kg = self._assumed.number(
                f"{name}.mass_kg", 1e-4, 1000.0, f"link {name}: states no mass", likely
            )
            centre = data_centre(self._data, group)
            return _Mass(kg, centre, np.zeros((3, 3)))
        centre = masses @ self._data.xipos[group] / masses.sum()
        inertia = np.zeros((3, 3))
        for body, mass in zip(group, masses, strict=True):
            turn = self._data.ximat[body].reshape(3, 3)
            arm = self._data.xipos[body] - centre
            inertia += turn @ np.diag(model.body_inertia[body]) @ turn.T
            inertia += mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        return _Mass(kg, centre, inertia)

    def _radii_m(self, lengths_m: list[float]) -> list[float]:
        """Radius of each link: from its shape, its inertia, or the others."""
        mean_m = float(np.mean([length for length in lengths_m if length > 0.0]))
        radii_m = [self._radius_m(k, mean_m) for k in range(len(lengths_m))]
        known_radii_m = [radius for radius in radii_m if radius is not None]
        missing = [
            self._tree.names[k]
            for k, radius in enumerate(radii_m)
            if radius is None and self._tree.groups[k]
        ]
        given = self._assumed.given("radius_m", 1e-4, 10.0) if missing else None
        other_m = given or (max(known_radii_m) if known_radii_m else _ASSUMED_RADIUS * mean_m)
        if missing and given is None:
            how = (
                "that of the thickest other"
                if known_radii_m
                else f"{_ASSUMED_RADIUS:g} of a mean link"
            )
            self.notes.append(
                f"radius of {len(missing)} links is assumed, {other_m:.3g} m ({how}): nothing "
                f"states it: {', '.join(missing[:3])}{', ...' if len(missing) > 3 else ''}; "
                "--assume radius_m=VALUE sets it"
            )
        return [other_m if radius is None else radius for radius in radii_m]

    def _radius_m(self, k: int, mean_m: float) -> float | None:
        if not self._tree.groups[k]:
            return None
        directions = self._directions
        geoms = self._solid[k]
        mass = self._masses[k]
        if geoms:
            widths = [
                sum(
                    max(_support(self._model, self._data, g, sign * side) for g in geoms)
                    for sign in (1.0, -1.0)
                )
                for side in (directions.left, directions.up)
            ]
            return 0.5 * max(widths)
        if mass.kg <= 0.0:
            return None
        along = float(directions.forward @ mass.inertia @ directions.forward)
        radius_m = math.sqrt(max(2.0 * along / mass.kg, 0.0))
        return radius_m if _THINNEST * mean_m <= radius_m <= _THICKEST * mean_m else None

    def _link(self, k: int, length_m: float, radius_m: float) -> LinkFigures:
        mass = self._masses[k]
        directions = self._directions
        if mass.kg <= 0.0 or length_m <= 0.0:
            return LinkFigures(length_m, mass.kg, radius_m, 0.0, 1.0)
        front_m = self.joints_m[k - 1] if k else self.joints_m[0] + length_m
        offset_m = abs(front_m - 0.5 * length_m - float(mass.centre @ directions.forward))
        across = 0.5 * sum(
            float(side @ mass.inertia @ side) for side in (directions.left, directions.up)
        )
        even = mass.kg * (3.0 * radius_m**2 + length_m**2) / 12.0
        return LinkFigures(
            length_m, mass.kg, radius_m, offset_m / length_m, across / even if across else 1.0
        )


def uneven_notes(links: list[LinkFigures], names: list[str]) -> list[str]:
    """Lines about masses that a robot file places otherwise."""
    notes = []
    offset, name = max((link.offset, name) for link, name in zip(links, names, strict=True))
    if offset > 0.01:
        notes.append(
            f"centres of mass are up to {100.0 * offset:.0f} % of their link's length from its "
            f"middle ({name}); the robot's file puts them in the middle"
        )
    spread = max((abs(math.log(max(link.spread, 1e-9))), link.spread) for link in links)[1]
    if spread > _POINT and abs(math.log(spread)) > math.log(1.0 + _SPREAD):
        notes.append(
            f"inertia across the body is up to {spread:.2g} times that of an even cylinder, which "
            "the robot's file assumes"
        )
    return notes


def data_centre(data: mujoco.MjData, group: list[int]) -> Floats:
    """Mean place of bodies without mass."""
    return np.asarray(data.xpos[group].mean(axis=0))


def _support(model: mujoco.MjModel, data: mujoco.MjData, geom: int, ahead: Floats) -> float:
    kind = model.geom_type[geom]
    size = model.geom_size[geom]
    centre = float(data.geom_xpos[geom] @ ahead)
    turned = ahead @ data.geom_xmat[geom].reshape(3, 3)
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
        first = model.mesh_vertadr[mesh]
        count = model.mesh_vertnum[mesh]
        return centre + float((model.mesh_vert[first : first + count] @ turned).max())
    return centre + float(size @ np.abs(turned))
