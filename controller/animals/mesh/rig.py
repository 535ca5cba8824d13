"""The rig: a mesh and the bones that carry its corners."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.controller.animals.mesh.skin import Skin, Weights, rest_fronts_m, weights
from snakewalk.controller.images.mesh import Mesh
from snakewalk.controller.track.bone_motion import BoneMotion


@dataclass(frozen=True, slots=True)
class Rig:
    """K bones; at rest each lies along -x from its front."""

    mesh: Mesh
    held: Weights
    """Weights of the corners."""
    rest_m: Floats
    """(K, 3) fronts of the bones at rest."""
    parent: Ints
    """(K,) parent of each bone, earlier in the order; -1: none."""
    names: tuple[str, ...]
    """K names of the bones, such as ``thigh_left``."""


def spine_rig(skin: Skin, bone_m: Floats) -> Rig:
    """Hang a skin on a spine's bones of lengths (K,), each carried by the one before."""
    rest_m = rest_fronts_m(bone_m, skin.axis_m)
    parent = np.arange(len(bone_m)) - 1
    names = tuple(f"spine_{k:02d}" for k in range(len(bone_m)))
    return Rig(skin.mesh, weights(skin, bone_m), rest_m, parent, names)


def posed_m(rig: Rig, motion: BoneMotion, frame: int) -> Floats:
    """(V, 3) corners in one frame of a motion of the same bones."""
    bones = rig.held.bones
    local = rig.mesh.vertices[:, None] - rig.rest_m[bones]
    turned = np.einsum("vkij,vkj->vki", motion.rotation[frame][bones], local)
    placed = turned + motion.front_m[frame][bones]
    return np.asarray((rig.held.shares[..., None] * placed).sum(axis=1))
