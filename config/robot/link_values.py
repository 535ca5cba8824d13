"""Values of each link, derived from the parsed keys."""

import math
from functools import cache
from itertools import accumulate

from snakewalk.config.robot.keys import RobotKeys, parsed
from snakewalk.config.robot.limbs import SIDES, LimbJoint
from snakewalk.config.robot.links import LinkShape


class LinkValues(RobotKeys):
    """Robot with the values of its links, head first; metres and kilograms."""

    @property
    def joint_count(self) -> int:
        """Number of servos J, legs included; there are J + 1 links."""
        return len(self.all_axes)

    @property
    def link_count(self) -> int:
        """Number of links L of the spine, before those of the legs."""
        return len(self.joint_axes) + 1

    @property
    def limb_joints(self) -> tuple[LimbJoint, ...]:
        """Joints of the legs in the order of the bus, after those of the spine."""
        return _limb_joints(tuple(pair.joint_axes for pair in self.limbs))

    @property
    def all_axes(self) -> str:
        """One letter per servo, first the spine, then the legs."""
        return self.joint_axes + "".join(2 * pair.joint_axes for pair in self.limbs)

    @property
    def link_parents(self) -> tuple[int, ...]:
        """(J + 1,) parent of each link, -1 for the head; joint i connects link i + 1 to it."""
        parents = list(range(-1, self.link_count - 1))
        for joint in self.limb_joints:
            hip = joint.place == 0
            parents.append(self.limbs[joint.pair].link if hip else len(parents) - 1)
        return tuple(parents)

    @property
    def mass_kg(self) -> float:
        """Mass of all links."""
        legs = sum(2 * len(pair.joint_axes) * pair.segment_mass_kg for pair in self.limbs)
        masses_kg = self.link_masses_kg
        if len(set(masses_kg)) > 1:
            return math.fsum(masses_kg) + legs
        return masses_kg[0] * self.link_count + legs

    @property
    def length_m(self) -> float:
        """Length of the spine."""
        if not self.links:
            return float(parsed(self, "link_length_m")) * self.link_count
        lengths_m = self.link_lengths_m
        if len(set(lengths_m)) > 1:
            return math.fsum(lengths_m)
        return lengths_m[0] * self.link_count

    @property
    def mean_link_length_m(self) -> float:
        """Mean link length of the spine."""
        if not self.links:
            return float(parsed(self, "link_length_m"))
        lengths_m = self.link_lengths_m
        if len(set(lengths_m)) > 1:
            return self.length_m / self.link_count
        return lengths_m[0]

    @property
    def mean_link_mass_kg(self) -> float:
        """Mean link mass of the spine."""
        masses_kg = self.link_masses_kg
        if len(set(masses_kg)) > 1:
            return math.fsum(masses_kg) / self.link_count
        return masses_kg[0]

    @property
    def link_lengths_m(self) -> tuple[float, ...]:
        """Length of each link of the spine, head first."""
        return self._of_links("length_m", parsed(self, "link_length_m"))

    @property
    def link_masses_kg(self) -> tuple[float, ...]:
        """Mass of each link of the spine, head first, with a stereo head's mast."""
        masses_kg = self.bare_link_masses_kg
        if self.stereo_head is None:
            return masses_kg
        head_link = self.stereo_head.link
        loaded_kg = masses_kg[head_link] + self.stereo_head.mass_kg
        return (*masses_kg[:head_link], loaded_kg, *masses_kg[head_link + 1 :])

    @property
    def bare_link_masses_kg(self) -> tuple[float, ...]:
        """Mass of each link of the spine, head first, without a stereo head's mast."""
        return self._of_links("mass_kg", parsed(self, "link_mass_kg"))

    @property
    def centre_distance_m(self) -> float:
        """Distance along the spine between the middles of the first and the last link."""
        lengths_m = self.link_lengths_m
        if len(set(lengths_m)) == 1:
            return lengths_m[0] * (self.link_count - 1)
        return self.length_m - 0.5 * (lengths_m[0] + lengths_m[-1])

    @property
    def link_radii_m(self) -> tuple[float, ...]:
        """Radius of each link of the spine, head first, without ``body_profile``."""
        return self._of_links("radius_m", self.body_radius_m)

    @property
    def link_shapes(self) -> tuple[LinkShape, ...]:
        """Ground contact shape of each link of the spine, head first."""
        if not self.links:
            return (self.belly.shape,) * self.link_count
        return tuple(
            link.shape or ("none" if link.length_m == 0.0 else self.belly.shape)
            for link in self.links
        )

    @property
    def link_ends(self) -> tuple[float, ...]:
        """(L + 1,) places of the head's tip, the spine's joints and the tail's end.

        The unit is the mean link length: 0, 1, 2 ... for equal links.
        """
        if not self.links:
            return _even_ends(self.link_count)
        lengths_m, mean_m = self.link_lengths_m, self.mean_link_length_m
        if len(set(lengths_m)) == 1:
            return _even_ends(self.link_count)
        inner = (run_m / mean_m for run_m in accumulate(lengths_m[:-1]))
        return (0.0, *inner, float(self.link_count))

    def _of_links(self, key: str, usual: float) -> tuple[float, ...]:
        """Value of a key for each link, by default ``usual``."""
        if not self.links:
            return (usual,) * self.link_count
        link_values = (getattr(link, key) for link in self.links)
        return tuple(usual if o is None else o for o in link_values)

    def radii_m(self, stations: int) -> tuple[float, ...]:
        """Body radius at ``stations`` (1 or more) equidistant places from tip to tip."""
        return self.radii_at_m(tuple(k / max(stations - 1, 1) for k in range(stations)))

    def radii_at_m(self, shares: tuple[float, ...]) -> tuple[float, ...]:
        """Body radius at places along the body: 0 is the head's tip, 1 the tail's."""
        if len(set(self.link_radii_m)) > 1:
            return tuple(self._radius_at_m(share * self.link_count) for share in shares)
        profile = self.body_profile or (1.0,)
        radii = []
        for share in shares:
            position = share * (len(profile) - 1)
            low = min(int(position), max(len(profile) - 2, 0))
            high = min(low + 1, len(profile) - 1)
            radii.append(profile[low] + (position - low) * (profile[high] - profile[low]))
        return tuple(self.body_radius_m * radius for radius in radii)

    def _radius_at_m(self, place: float) -> float:
        """Radius at a place in the unit of ``link_ends``; at a joint that of the thicker link."""
        ends = self.link_ends
        return max(
            radius_m
            for radius_m, front, back in zip(self.link_radii_m, ends, ends[1:], strict=False)
            if front <= place <= back
        )


@cache
def _limb_joints(pairs: tuple[str, ...]) -> tuple[LimbJoint, ...]:
    """Joints of the legs; ``pairs`` holds the axes of each pair."""
    return tuple(
        LimbJoint(index, side, place, place == len(axes) - 1)
        for index, axes in enumerate(pairs)
        for side in SIDES
        for place in range(len(axes))
    )


@cache
def _even_ends(links: int) -> tuple[float, ...]:
    return tuple(float(k) for k in range(links + 1))
