"""A mesh as files: Wavefront OBJ with its material and texture beside it, or one binary glTF."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image as Pillow

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.mesh.mesh import Mesh

SKIN_RGB = (0.66, 0.48, 0.20)
"""Of a body without a picture."""


def mesh_files(file: Path, textured: bool) -> list[Path]:
    """List what ``write_mesh`` writes.

    Raises:
        InputError: an ending that is neither .obj nor .glb.

    """
    if file.suffix.lower() == ".glb":
        return [file]
    if file.suffix.lower() != ".obj":
        raise InputError(f"{file}: a body is written as .obj or .glb")
    return [file, file.with_suffix(".mtl"), *([file.with_suffix(".png")] if textured else [])]


def write_mesh(file: Path, mesh: Mesh, texture: Image | None) -> list[Path]:
    """Write a mesh; OBJ keeps z up, glTF wants y up and gets it.

    Args:
        file: ends in .obj or .glb.
        mesh: of the body.
        texture: (H, W, 3), first row at v = 1; None paints the skin in one colour.

    Returns:
        The files written.

    """
    files = mesh_files(file, texture is not None)
    if len(files) == 1:
        file.write_bytes(_glb(mesh, texture))
        return files
    files[0].write_text(_obj(mesh, files[1].name), encoding="ascii", errors="backslashreplace")
    skin = " ".join(f"{c:g}" for c in ((1.0, 1.0, 1.0) if texture is not None else SKIN_RGB))
    lines = ["newmtl skin", f"Kd {skin}", "Ka 0 0 0", "Ks 0.05 0.05 0.05", "Ns 10", "illum 2"]
    if texture is not None:
        files[2].write_bytes(_png(texture))
        lines.append(f"map_Kd {files[2].name}")
    files[1].write_text("\n".join(lines) + "\n")
    return files


def _obj(mesh: Mesh, material: str) -> str:
    """Text of the OBJ; indices count from 1."""
    lines = [f"mtllib {material}", "o body"]
    lines += [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"vt {u:.6f} {v:.6f}" for u, v in mesh.uv.tolist()]
    lines += [f"vn {x:.5f} {y:.5f} {z:.5f}" for x, y, z in mesh.normals.tolist()]
    lines.append("usemtl skin")
    for a, b, c in (mesh.faces + 1).tolist():
        lines.append(f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")
    return "\n".join(lines) + "\n"


def _glb(mesh: Mesh, texture: Image | None) -> bytes:
    """Bytes of the glTF."""
    turned = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    visual: Any = trimesh.visual  # its classes have no types
    paint: dict[str, Any] = {"baseColorFactor": [*SKIN_RGB, 1.0]}
    if texture is not None:
        paint = {"baseColorTexture": Pillow.fromarray(texture)}
    skin = visual.material.PBRMaterial(metallicFactor=0.0, roughnessFactor=0.8, **paint)
    body: Any = trimesh.Trimesh(
        vertices=mesh.vertices @ turned.T,
        faces=mesh.faces,
        vertex_normals=mesh.normals @ turned.T,
        visual=visual.TextureVisuals(uv=mesh.uv, material=skin),
        process=False,
    )
    return bytes(trimesh.Scene({"body": body}).export(file_type="glb"))  # type: ignore[no-untyped-call]


def _png(texture: Image) -> bytes:
    buffer = io.BytesIO()
    Pillow.fromarray(texture).save(buffer, "PNG")
    return buffer.getvalue()
