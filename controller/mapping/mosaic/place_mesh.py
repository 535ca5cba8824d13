"""The place along a route as a textured mesh (binary glTF, y up)."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image as Pillow

from snakewalk.controller.mapping.mosaic.walk import StereoWalk
from snakewalk.controller.mapping.mosaic.walk_ground import level_stand


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
        shown = model.cells & near[1:, 1:] & near[:-1, :-1]
        corner = (np.arange(high * wide).reshape(high, wide)[:-1, :-1])[shown]
        faces = np.concatenate(
            [
                np.stack([corner, corner + wide, corner + 1], axis=1),
                np.stack([corner + wide, corner + wide + 1, corner + 1], axis=1),
            ]
        )
        used, index = np.unique(faces, return_inverse=True)
        row, column = np.divmod(used, wide)
        uv = np.column_stack([(column + 0.5) / wide, 1.0 - (row + 0.5) / high])
        paint = visual.material.PBRMaterial(
            metallicFactor=0.0, roughnessFactor=1.0, baseColorTexture=Pillow.fromarray(model.image)
        )
        mesh: Any = trimesh.Trimesh(
            vertices[used],
            index.reshape(-1, 3),
            visual=visual.TextureVisuals(uv=uv, material=paint),
            process=False,
        )
        scene.add_geometry(mesh, node_name=f"position_{number + 1}")
    file.write_bytes(bytes(scene.export(file_type="glb")))
