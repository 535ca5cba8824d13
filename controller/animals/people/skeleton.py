"""The skeleton of a person: joints at rest, in shares of the stature.

Segment lengths and joint heights are those of Winter, Biomechanics and Motor Control of Human
Movement, Fig. 4.1 (after Drillis and Contini, 1966). The person faces x, y is to the left, z up.
The arms are held away from the body, which keeps their curves off the trunk.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats, Ints

THIGH = 0.245
SHANK = 0.246
ANKLE = 0.039
"""Height of the ankle over the sole."""
FOOT = 0.152
"""Length of a foot."""
UPPER_ARM = 0.186
FOREARM = 0.146
HAND = 0.108
HIP_SIDE = 0.052
"""Distance of a hip from the middle plane (ours)."""
SHOULDER = (-0.006, 0.112, 0.795)
"""Centre of the left shoulder (ours): below the acromion, whose height is 0.818."""
HEEL = -0.035
"""Rearmost place of the foot, ahead of the ankle (ours)."""
BALL = 0.075
"""Place where the toes bend, ahead of the ankle (ours)."""
ABDUCTION_RAD = 0.42
"""Angle of the arms at rest from the vertical (ours)."""

BONES = (
    ("pelvis", -1),
    ("waist", 0),
    ("chest", 1),
    ("neck", 2),
    ("head", 3),
    ("left upper arm", 2),
    ("left forearm", 5),
    ("left hand", 6),
    ("right upper arm", 2),
    ("right forearm", 8),
    ("right hand", 9),
    ("left thigh", 0),
    ("left shank", 11),
    ("left foot", 12),
    ("left toes", 13),
    ("right thigh", 0),
    ("right shank", 15),
    ("right foot", 16),
    ("right toes", 17),
)
"""Name and parent of each bone."""
INDEX = {name: k for k, (name, _) in enumerate(BONES)}


@dataclass(frozen=True, slots=True)
class PersonSkeleton:
    """Joints of a person at rest, metres."""

    stature_m: float
    joint_m: Floats
    """(K, 3) upper end of each bone."""
    length_m: Floats
    """(K,) lengths of the bones."""
    parent: Ints
    """(K,) parent of each bone; -1: none."""

    @classmethod
    def of(cls, stature_m: float) -> "PersonSkeleton":
        """Return the skeleton of a stature."""
        places: dict[str, tuple[float, float, float]] = {
            "pelvis": (0.0, 0.0, ANKLE + SHANK + THIGH),
            "waist": (-0.004, 0.0, 0.600),
            "chest": (-0.008, 0.0, 0.680),
            "neck": (-0.010, 0.0, 0.825),
            "head": (-0.004, 0.0, 0.870),
        }
        along = np.array([0.0, np.sin(ABDUCTION_RAD), -np.cos(ABDUCTION_RAD)])
        for side, sign in (("left", 1.0), ("right", -1.0)):
            mirror = np.array([1.0, sign, 1.0])
            arm = {"upper arm": 0.0, "forearm": UPPER_ARM, "hand": UPPER_ARM + FOREARM}
            for name, far in arm.items():
                place = mirror * (np.array(SHOULDER) + far * along)
                places[f"{side} {name}"] = (float(place[0]), float(place[1]), float(place[2]))
            hip = sign * HIP_SIDE
            places[f"{side} thigh"] = (0.0, hip, ANKLE + SHANK + THIGH)
            places[f"{side} shank"] = (0.0, hip, ANKLE + SHANK)
            places[f"{side} foot"] = (0.0, hip, ANKLE)
            places[f"{side} toes"] = (BALL, hip, 0.0)
        lengths = {
            "pelvis": 0.07,
            "waist": 0.08,
            "chest": 0.145,
            "neck": 0.045,
            "head": 0.13,
            "upper arm": UPPER_ARM,
            "forearm": FOREARM,
            "hand": HAND,
            "thigh": THIGH,
            "shank": SHANK,
            "foot": BALL,
            "toes": FOOT + HEEL - BALL,
        }
        return cls(
            stature_m,
            stature_m * np.array([places[name] for name, _ in BONES]),
            stature_m * np.array([lengths[_part(name)] for name, _ in BONES]),
            np.array([parent for _, parent in BONES], dtype=np.int64),
        )


def bone_name(name: str) -> str:
    """Return the name of a bone in a file: ``left upper arm`` is ``upper_arm_left``."""
    part = _part(name)
    return "_".join([*part.split(), *name.removesuffix(part).split()])


def _part(name: str) -> str:
    """Name of a bone without its side."""
    return name.removeprefix("left ").removeprefix("right ")
