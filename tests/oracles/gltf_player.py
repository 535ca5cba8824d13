"""Plays a binary glTF with one skin by the text of the specification, without any glTF library."""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
_TYPES = {5121: "<u1", 5125: "<u4", 5126: "<f4"}
_WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass
class GltfPlayer:
    """The file's tree and its binary chunk."""

    tree: dict[str, Any]
    binary: bytes

    @staticmethod
    def read(file: Path) -> "GltfPlayer":
        data = file.read_bytes()
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON"
        tree = json.loads(data[20 : 20 + size])
        binary_size, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\0"
        return GltfPlayer(tree, data[28 + size : 28 + size + binary_size])

    def array(self, accessor: int) -> Floats:
        """An accessor's values, (n,) or (n, width)."""
        at = self.tree["accessors"][accessor]
        view = self.tree["bufferViews"][at["bufferView"]]
        width, kind = _WIDTH[at["type"]], np.dtype(_TYPES[at["componentType"]])
        start = view.get("byteOffset", 0)
        raw = np.frombuffer(self.binary, kind, at["count"] * width, start).astype(float)
        return raw if width == 1 else raw.reshape(-1, width)

    @property
    def time_s(self) -> Floats:
        return self.array(self.tree["animations"][0]["samplers"][0]["input"])

    def bones(self, frame: int) -> Floats:
        """(K, 4, 4) global transforms of the skin's joints at a key frame."""
        own = {n: dict(node) for n, node in enumerate(self.tree["nodes"])}
        animation = self.tree["animations"][0]
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            assert sampler.get("interpolation", "LINEAR") == "LINEAR"
            target = channel["target"]
            own[target["node"]][target["path"]] = self.array(sampler["output"])[frame]
        world: dict[int, Floats] = {}

        def place(node: int, above: Floats) -> None:
            local = np.eye(4)
            turn = own[node].get("rotation", [0.0, 0.0, 0.0, 1.0])
            local[:3, :3] = Rotation.from_quat(turn).as_matrix()
            local[:3, 3] = own[node].get("translation", [0.0, 0.0, 0.0])
            world[node] = above @ local
            for child in own[node].get("children", []):
                place(child, world[node])

        for root in self.tree["scenes"][0]["nodes"]:
            place(root, np.eye(4))
        return np.array([world[joint] for joint in self.tree["skins"][0]["joints"]])

    def attribute(self, name: str) -> Floats:
        return self.array(self.tree["meshes"][0]["primitives"][0]["attributes"][name])

    def corners(self, frame: int) -> Floats:
        """(V, 3) skinned, y up."""
        inverse = self.array(self.tree["skins"][0]["inverseBindMatrices"])
        bind = inverse.reshape(-1, 4, 4).transpose(0, 2, 1)
        joints = self.attribute("JOINTS_0").astype(int)
        blend = np.einsum(
            "vk,vkij->vij", self.attribute("WEIGHTS_0"), (self.bones(frame) @ bind)[joints]
        )
        rest = self.attribute("POSITION")
        return np.einsum("vij,vj->vi", blend[:, :3, :3], rest) + blend[:, :3, 3]
