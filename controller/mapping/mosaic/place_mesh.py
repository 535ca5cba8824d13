"""The place along a route as a textured mesh (binary glTF, y up)."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image as Pillow

from snakewalk.config.arrays import Bools, Ints
from snakewalk.controller.mapping.mosaic.walk import StereoWalk
from snakewalk.controller.mapping.mosaic.walk_ground import level_stand

BLOCK_PX = 4
"""Side of the blocks that become two triangles (ours)."""


def write_place(file: Path, walk: StereoWalk, error_m: float) -> None:
    """Write the surfaces of all positions, each with its photograph.

    The origin is below the first left camera. Its direction of view is -z, and y is up.

    Args:
        file: ends in .glb.
        walk: models and poses of the positions.
        error_m: cells with a larger expected error are left out.

    Raises:
        InputError: the first position shows no ground.

    """
    stand = level_stand(walk, error_m)
    to_gltf = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
    visual: Any = trimesh.visual  # its classes have no types
    scene: Any = trimesh.Scene()
    for number, (model, pose) in enumerate(zip(walk.models, walk.poses, strict=True)):
        high, wide = model.valid.shape
        points_m = model.points_m @ pose[:, :3].T + pose[:, 3]
        vertices = (points_m @ stand.world_from_camera().T @ to_gltf.T).reshape(-1, 3)
        vertices[:, 1] += stand.height_m
        near = model.near(error_m)
        row, column = np.indices((high, wide)).reshape(2, -1)
        uv = np.column_stack([(column + 0.5) / wide, 1.0 - (row + 0.5) / high])
        paint = visual.material.PBRMaterial(
            metallicFactor=0.0, roughnessFactor=1.0, baseColorTexture=Pillow.fromarray(model.image)
        )
        mesh: Any = trimesh.Trimesh(
            vertices,
            triangles_over(model.cells & near[1:, 1:] & near[:-1, :-1]),
            visual=visual.TextureVisuals(uv=uv, material=paint),
            process=False,
        )
        mesh.remove_unreferenced_vertices()
        scene.add_geometry(mesh, node_name=f"position_{number + 1}")
    file.write_bytes(bytes(scene.export(file_type="glb", tree_postprocessor=_without_light)))


def triangles_over(shown: Bools) -> Ints:
    """(n, 3) pixels of the triangles over the cells that are shown.

    Blocks of ``BLOCK_PX`` cells get two triangles if all their cells are shown, else two a cell.
    """
    high, wide = shown.shape
    shown = np.pad(shown, ((0, -high % BLOCK_PX), (0, -wide % BLOCK_PX)))
    triangles = []
    for side in (BLOCK_PX, 1):
        blocks = shown.reshape(-1, side, shown.shape[1] // side, side)
        full = blocks.all(axis=(1, 3), keepdims=True)
        row, _, column, _ = side * np.array(np.nonzero(full))
        blocks &= ~full  # a view: the cells are gone from ``shown``
        a = row * (wide + 1) + column
        b = a + side * (wide + 1)
        triangles += [np.stack([a, b, a + side], axis=1), np.stack([b, b + side, a + side], axis=1)]
    return np.concatenate(triangles)


def _without_light(tree: dict[str, Any]) -> None:
    """Show photographs as they are: their places were lit when they were taken."""
    tree["extensionsUsed"] = ["KHR_materials_unlit"]
    for material in tree["materials"]:
        material["extensions"] = {"KHR_materials_unlit": {}}
