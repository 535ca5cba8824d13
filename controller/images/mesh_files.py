"""Mesh files: Wavefront OBJ with material and texture, or binary glTF."""

import io
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image as Pillow

from snakewalk.config.archive import check_expansion, parse_json, read_bytes, why_no_file
from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.images.mesh import Mesh

SKIN_RGB = (0.66, 0.48, 0.20)
"""Colour of a body without a picture."""
MOST_PIXELS = 8192**2
"""Limit of a mesh's pictures (ours)."""
_ITEM_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
"""Sizes of glTF's kinds of numbers (bytes) and of items (numbers)."""
MESH_ENDINGS = (".obj", ".glb")
_AXES = {
    f"{sign}{axis}": (k, factor)
    for sign, factor in (("", 1.0), ("+", 1.0), ("-", -1.0))
    for k, axis in enumerate("xyz")
}


@dataclass(frozen=True, slots=True)
class GivenMesh:
    """A mesh of another program, turned so that x is forward and z up."""

    mesh: Mesh
    solid: Any
    """Mesh of ``trimesh`` with the same triangles and joined corners, for cutting."""
    texture: Image | None
    """(H, W, 3), first row at v = 1."""
    forward: str
    """Axis of the file along which the head lies."""
    up: str
    """Axis of the file that points up."""


def read_mesh(file: Path, forward: str | None = None, up: str | None = None) -> GivenMesh:
    """Read the triangles of an OBJ or a binary glTF, with the texture if there is one picture.

    Args:
        file: ends in .obj or .glb; the parts of a scene are joined.
        forward: ``+x``, ``-z``, ...: direction of the head; default: +, along the longest side.
        up: default: +y for glTF (its standard), +z for OBJ; the other of both if it is ``forward``.

    Raises:
        InputError: no such file, no triangles, or axes that are unknown or parallel.

    """
    if not file.is_file():
        raise InputError(why_no_file(file))
    try:
        size = file.stat().st_size
        check_expansion(file, size, _unpacked_glb(file) if file.suffix.lower() == ".glb" else size)
        scene: Any = trimesh.load_scene(file)
        _check_pictures(file, scene)
        solid: Any = scene.to_mesh()
        normals = np.asarray(solid.vertex_normals, dtype=float)
    except InputError:
        raise
    except Exception as error:  # trimesh passes on any error of its parsers
        raise InputError(f"{file}: cannot be read as a mesh: {error}") from None
    if not (
        len(solid.faces) and solid.vertices.shape[1] == 3 and np.isfinite(solid.vertices).all()
    ):
        raise InputError(f"{file}: holds no triangles")
    longest = "xyz"[int(np.argmax(np.ptp(solid.vertices, axis=0)))]
    ahead = f"+{longest}" if forward is None else forward
    above = up if up is not None else "+y" if file.suffix.lower() == ".glb" else "+z"
    if up is None and above[1] == ahead[-1:]:
        above = "+z" if above == "+y" else "+y"
    x, z = _axis(ahead, "forward"), _axis(above, "up")
    if not np.isclose(x @ z, 0.0):
        raise InputError(f"{file}: --forward {ahead} and --up {above} are one axis")
    turned = np.stack([x, np.cross(z, x), z])
    picture = _picture_of(solid.visual)
    texture = None if picture is None else np.asarray(picture.convert("RGB"))
    uv = getattr(solid.visual, "uv", None)
    vertices = np.asarray(solid.vertices, dtype=float) @ turned.T
    normals = normals @ turned.T
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    mesh = Mesh(
        vertices=vertices,
        normals=np.where(size > 0.5, normals / np.maximum(size, 1e-300), [0.0, 0.0, 1.0]),
        uv=np.zeros((len(vertices), 2)) if uv is None else np.asarray(uv, dtype=float),
        faces=np.asarray(solid.faces, dtype=np.int64),
    )
    joined: Any = trimesh.Trimesh(vertices, solid.faces, process=True)
    joined.merge_vertices(merge_tex=True, merge_norm=True)
    return GivenMesh(mesh, joined, texture if uv is not None else None, ahead, above)


def _unpacked_glb(file: Path) -> int:
    """Bytes of numbers that a binary glTF declares for its meshes, once for each node.

    Views may overlap, accessors without a view are zeros, and many nodes may use one mesh.
    """
    data = read_bytes(file)
    _, _, _, length, _ = struct.unpack("<5I", data[:20])
    said = parse_json(data[20 : 20 + length])
    views = [abs(int(view["byteLength"])) for view in said.get("bufferViews", [])]
    accessors = [
        abs(int(a["count"])) * _WIDTH[a["type"]] * _ITEM_BYTES[a["componentType"]]
        for a in said.get("accessors", [])
    ]
    meshes = [
        sum(
            accessors[index]
            for primitive in mesh["primitives"]
            for index in (*primitive["attributes"].values(), primitive.get("indices"))
            if index is not None
        )
        for mesh in said.get("meshes", [])
    ]
    shown = [meshes[node["mesh"]] for node in said.get("nodes", []) if "mesh" in node]
    return int(sum(views) + sum(accessors) + sum(meshes) + sum(shown))


def _check_pictures(file: Path, scene: Any) -> None:
    pictures = {
        id(p): p for g in scene.geometry.values() if (p := _picture_of(g.visual)) is not None
    }
    pixels = sum(picture.width * picture.height for picture in pictures.values())
    if pixels > MOST_PIXELS:
        raise InputError(
            f"{file}: its pictures have {pixels / 1e6:.0f} million pixels; at most "
            f"{MOST_PIXELS / 1e6:.0f} million are read"
        )


def _axis(name: str, option: str) -> Any:
    if name not in _AXES:
        raise InputError(f"--{option} {name}: expected one of +x, -x, +y, -y, +z, -z")
    axis, sign = _AXES[name]
    return sign * np.eye(3)[axis]


def _picture_of(visual: Any) -> Any:
    """Picture of a mesh (Pillow), or None."""
    material = getattr(visual, "material", None)
    return getattr(material, "baseColorTexture", None) or getattr(material, "image", None)


def mesh_files(file: Path, textured: bool) -> list[Path]:
    """List the files that ``write_mesh`` writes.

    Raises:
        InputError: the name ends neither in .obj nor in .glb.

    """
    if file.suffix.lower() == ".glb":
        return [file]
    if file.suffix.lower() != ".obj":
        raise InputError(f"{file}: a body is written as .obj or .glb")
    return [file, file.with_suffix(".mtl"), *([file.with_suffix(".png")] if textured else [])]


def write_mesh(file: Path, mesh: Mesh, texture: Image | None) -> list[Path]:
    """Write a mesh with z up in OBJ, y up in glTF; return the files.

    Args:
        file: ends in .obj or .glb.
        mesh: mesh to write.
        texture: (H, W, 3), first row at v = 1; None: one colour.

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
    lines = [f"mtllib {material}", "o body"]
    lines += [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"vt {u:.6f} {v:.6f}" for u, v in mesh.uv.tolist()]
    lines += [f"vn {x:.5f} {y:.5f} {z:.5f}" for x, y, z in mesh.normals.tolist()]
    lines.append("usemtl skin")
    for a, b, c in (mesh.faces + 1).tolist():
        lines.append(f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")
    return "\n".join(lines) + "\n"


def _glb(mesh: Mesh, texture: Image | None) -> bytes:
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
