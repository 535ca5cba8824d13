"""A moving skin as one binary glTF 2.0: mesh, texture, bones, weights and an animation.

The bones are a chain of nodes, head first, so interpolation between two frames keeps lengths. glTF
has y up: one node above the bones turns the world.
"""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
from PIL import Image as Pillow
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats, Image, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.mesh.rig import Rig
from snakewalk.controller.images.mesh_files import SKIN_RGB
from snakewalk.controller.track.bone_motion import BoneMotion

MOST_BONES = 256
"""Bones count in bytes."""
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
_ROOT_QUATERNION = [-float(np.sqrt(0.5)), 0.0, 0.0, float(np.sqrt(0.5))]
_STILL_SHARE = 1e-6
"""Share of the body's length: a bone that moves less relative to the one before does not slide."""


def write_skin(
    file: Path,
    rig: Rig,
    motion: BoneMotion,
    texture: Image | None,
    name: str,
    *,
    both_sides: bool = False,
) -> None:
    """Write a skin that moves; metres, x forward, y up, -z to the left of a body that faces x.

    Args:
        file: ends in .glb.
        rig: of the motion's size.
        motion: of the rig's bones, at most 256.
        texture: (H, W, 3), first row at v = 1; None paints the skin in one colour.
        name: of mesh and animation.
        both_sides: draw the inside of the mesh, too: for one with holes.

    Raises:
        InputError: too many bones, or fewer than two frames.

    """
    bones = len(motion.bone_m)
    if bones > MOST_BONES:
        raise InputError(f"{file}: a skin has at most {MOST_BONES} bones, not {bones}")
    if len(motion.time_s) < 2:
        raise InputError(f"{file}: an animation needs two frames or more")
    out = _Builder()
    attributes = _surface(out, rig, textured=texture is not None)
    faces = out.add(
        rig.mesh.faces.astype(np.uint32).ravel(), "SCALAR", pygltflib.ELEMENT_ARRAY_BUFFER
    )
    nodes, local = _bones(rig)
    animation = _animation(out, rig, motion, local, name)
    gltf = pygltflib.GLTF2(
        asset=pygltflib.Asset(
            version="2.0",
            generator="snakewalk",
            extras=dict(motion.pose),
        ),
        scene=0,
        scenes=[pygltflib.Scene(name=name, nodes=[0, 1])],
        nodes=nodes,
        meshes=[
            pygltflib.Mesh(
                name=name,
                primitives=[pygltflib.Primitive(attributes=attributes, indices=faces, material=0)],
            )
        ],
        skins=[
            pygltflib.Skin(
                joints=list(range(2, bones + 2)),
                skeleton=2,
                inverseBindMatrices=out.add(_to_bones(rig), "MAT4", None),
            )
        ],
        animations=[animation],
        materials=[_material(texture is not None, both_sides)],
    )
    if texture is not None:
        gltf.images = [pygltflib.Image(bufferView=out.picture(texture), mimeType="image/png")]
        gltf.textures = [pygltflib.Texture(source=0, sampler=0)]
        clamp = pygltflib.CLAMP_TO_EDGE
        gltf.samplers = [pygltflib.Sampler(wrapS=clamp, wrapT=clamp)]
    gltf.accessors = out.accessors
    gltf.bufferViews = out.views
    gltf.buffers = [pygltflib.Buffer(byteLength=len(out.data))]
    gltf.set_binary_blob(bytes(out.data))
    file.write_bytes(b"".join(gltf.save_to_bytes()))


def _surface(out: "_Builder", rig: Rig, *, textured: bool) -> pygltflib.Attributes:
    """Append places, normals, bones and weights of the corners."""
    mesh = rig.mesh
    weights = rig.held
    shares = np.zeros((len(mesh.vertices), 4), np.float32)
    shares[:, [0, 2]] = weights.shares[:, [0, 2]]
    shares[:, 1] = np.float32(1.0) - shares[:, 0] - shares[:, 2]  # sum 1 in single precision
    joints = np.zeros((len(mesh.vertices), 4), np.uint8)
    joints[:, :3] = np.where(shares[:, :3] > 0.0, weights.bones, 0)  # no bone may idle
    array = pygltflib.ARRAY_BUFFER
    normals = mesh.normals @ Y_UP.T
    attributes = pygltflib.Attributes(
        POSITION=out.add(mesh.vertices @ Y_UP.T, "VEC3", array, bounds=True),
        NORMAL=out.add(normals / np.linalg.norm(normals, axis=1, keepdims=True), "VEC3", array),
        JOINTS_0=out.add(joints, "VEC4", array),
        WEIGHTS_0=out.add(shares, "VEC4", array),
    )
    if textured:
        attributes.TEXCOORD_0 = out.add(mesh.uv * [1.0, -1.0] + [0.0, 1.0], "VEC2", array)
    return attributes


def _to_bones(rig: Rig) -> Floats:
    """(K, 16) matrices from the body at rest into each bone, column by column."""
    bones = len(rig.rest_m)
    inverse = np.zeros((bones, 4, 4))
    inverse[:, :3, :3] = Y_UP
    inverse[:, 3, :3] = -rig.rest_m
    inverse[:, 3, 3] = 1.0
    return inverse.reshape(bones, 16)


def _bones(rig: Rig) -> tuple[list[pygltflib.Node], Floats]:
    """Return the nodes, and the places (K, 3) of the bones at rest in their parents."""
    rest = rig.rest_m
    carried = rig.parent >= 0
    local = np.where(carried[:, None], rest - rest[rig.parent], rest)
    nodes = [
        pygltflib.Node(name="body", mesh=0, skin=0),
        pygltflib.Node(
            name="root",
            rotation=_ROOT_QUATERNION,
            children=(np.flatnonzero(~carried) + 2).tolist(),
        ),
    ]
    for k in range(len(rest)):
        children = (np.flatnonzero(rig.parent == k) + 2).tolist()
        nodes.append(
            pygltflib.Node(name=rig.names[k], translation=local[k].tolist(), children=children)
        )
    return nodes, local


def _animation(
    out: "_Builder", rig: Rig, motion: BoneMotion, local: Floats, name: str
) -> pygltflib.Animation:
    """Append the turns of all bones, and the places of those that slide."""
    turn, place = _motion_in_parents(motion, rig.parent)
    time = out.add(motion.time_s, "SCALAR", None, bounds=True)
    samplers: list[pygltflib.AnimationSampler] = []
    channels: list[pygltflib.AnimationChannel] = []
    slides = np.abs(place - local).max(axis=(0, 2)) > _STILL_SHARE * motion.length_m
    for k in range(len(motion.bone_m)):
        paths: list[tuple[str, Floats, str]] = [("rotation", turn[:, k], "VEC4")]
        if slides[k] or rig.parent[k] < 0:
            paths.append(("translation", place[:, k], "VEC3"))
        for path, values, kind in paths:
            target = pygltflib.AnimationChannelTarget(node=k + 2, path=path)
            channels.append(pygltflib.AnimationChannel(sampler=len(samplers), target=target))
            samplers.append(
                pygltflib.AnimationSampler(input=time, output=out.add(values, kind, None))
            )
    return pygltflib.Animation(name=name, samplers=samplers, channels=channels)


def _motion_in_parents(motion: BoneMotion, parent: Ints) -> tuple[Floats, Floats]:
    """Quaternions (T, K, 4), x y z w, and places (T, K, 3) of bones in those that carry them."""
    frames, bones = motion.front_m.shape[:2]
    rotation = motion.rotation.copy()
    place = motion.front_m.copy()
    rows = np.flatnonzero(parent >= 0)
    before = motion.rotation[:, parent[rows]]
    off = motion.front_m[:, rows] - motion.front_m[:, parent[rows]]
    rotation[:, rows] = np.einsum("tkji,tkjl->tkil", before, motion.rotation[:, rows])
    place[:, rows] = np.einsum("tkji,tkj->tki", before, off)
    turn = Rotation.from_matrix(rotation.reshape(-1, 3, 3)).as_quat().reshape(frames, bones, 4)
    flips = np.where((turn[1:] * turn[:-1]).sum(axis=-1) < 0.0, -1.0, 1.0)
    turn[1:] *= flips.cumprod(axis=0)[..., None]  # the short way from frame to frame
    return turn, place


def _material(textured: bool, both_sides: bool) -> pygltflib.Material:
    paint: dict[str, Any] = {"baseColorFactor": [*SKIN_RGB, 1.0]}
    if textured:
        paint = {"baseColorTexture": pygltflib.TextureInfo(index=0)}
    return pygltflib.Material(
        name="skin",
        doubleSided=both_sides,
        pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(
            metallicFactor=0.0, roughnessFactor=0.7, **paint
        ),
    )


class _Builder:
    """The binary chunk and its index."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.accessors: list[pygltflib.Accessor] = []
        self.views: list[pygltflib.BufferView] = []

    def add(self, values: Any, kind: str, target: int | None, *, bounds: bool = False) -> int:
        """Append an array (n,) or (n, width), and return its accessor; numbers become float32."""
        rows = np.asarray(values)
        rows = rows.astype(np.float32) if rows.dtype.kind == "f" else rows
        types = {"f4": pygltflib.FLOAT, "u4": pygltflib.UNSIGNED_INT, "u1": pygltflib.UNSIGNED_BYTE}
        low, high = (np.atleast_1d(f(axis=0)).tolist() for f in (rows.min, rows.max))
        self.accessors.append(
            pygltflib.Accessor(
                bufferView=self._view(rows.astype(rows.dtype.newbyteorder("<")).tobytes(), target),
                componentType=types[rows.dtype.str[1:]],
                count=len(rows),
                type=kind,
                min=low if bounds else None,
                max=high if bounds else None,
            )
        )
        return len(self.accessors) - 1

    def picture(self, texture: Image) -> int:
        png = io.BytesIO()
        Pillow.fromarray(texture).save(png, "PNG")
        return self._view(png.getvalue(), None)

    def _view(self, data: bytes, target: int | None) -> int:
        self.data += bytes(-len(self.data) % 4)
        self.views.append(
            pygltflib.BufferView(
                buffer=0, byteOffset=len(self.data), byteLength=len(data), target=target
            )
        )
        self.data += data
        return len(self.views) - 1
