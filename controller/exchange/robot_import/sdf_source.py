"""SDF (Gazebo) rewritten as URDF: frames of links move to their joints.

Semantics of frames: http://sdformat.org/tutorials?tut=pose_frame_semantics. libsdformat has no
Python package on PyPI, and MuJoCo reads no SDF.
"""

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.exchange.robot_import.model_source import (
    LineElement,
    added,
    children,
    counted,
    numbers,
)

_MODEL = "__model__"
_ONE_FILE = "write it as one model, for example by: gz sdf -p FILE > FLAT.sdf"
_SHAPES = {
    "box": {"size": "size"},
    "cylinder": {"radius": "radius", "length": "length"},
    "capsule": {"radius": "radius", "length": "length"},
    "sphere": {"radius": "radius"},
    "mesh": {"filename": "uri", "scale": "scale"},
}
"""Shapes that URDF has too: URDF's attributes, and SDF's elements."""
_JOINTS = ("revolute", "continuous", "prismatic", "fixed")
_LIMITS = ("lower", "upper", "effort", "velocity")
_ENDLESS = 1e6
"""Limits beyond it are ignored: the default of SDF is 1e16."""


def urdf_of_sdf(root: LineElement, path: Path) -> tuple[LineElement, list[str]]:
    """Return a URDF of the model in an SDF, and lines about parts that were left out.

    Raises:
        InputError: several models or files, a frame that is not stated, or a joint that URDF does
            not have.

    """
    models = [model for model in root.iter("model") if model.find("joint") is not None]
    if len(models) != 1 or any(models[0].find(tag) is not None for tag in ("include", "model")):
        raise InputError(f"{path}: expected one model, without other models in it; {_ONE_FILE}")
    model = models[0]
    assert isinstance(model, LineElement)
    in_model = _Frames(model, path)
    is_old = (numbers(root.get("version"), 1) or [1.5])[0] < 1.5
    urdf = LineElement("robot", {"name": "sdf"})
    joints = children(model, "joint")
    bases = {_text(joint, "child"): in_model.of(str(joint.get("name"))) for joint in joints}
    for link in children(model, "link"):
        _add_link(urdf, link, in_model, bases)
    if any(_text(joint, "parent") == "world" for joint in joints):
        added(urdf, "link", name="world")
        bases["world"] = np.eye(4)
    for joint in joints:
        parent, child, kind = _text(joint, "parent"), _text(joint, "child"), str(joint.get("type"))
        if kind not in _JOINTS or not {parent, child} <= bases.keys():
            raise InputError(
                f"{path}: joint {joint.get('name')}, {joint.where}: is {kind} from {parent} to "
                f"{child}; expected {', '.join(_JOINTS)} between two links"
            )
        urdf_element = _like(joint, urdf, "joint", name=str(joint.get("name")), type=kind)
        added(urdf_element, "parent", link=parent)
        added(urdf_element, "child", link=child)
        _add_origin(urdf_element, np.linalg.inv(bases[parent]) @ bases[child])
        axis = joint.find("axis")
        if axis is not None and kind != "fixed":
            _add_axis(urdf_element, axis, in_model, bases[child], is_old=is_old)
    dropped = [part.tag for part in model.iter() if part.tag in ("plugin", "sensor")]
    return urdf, [f"left out of the SDF: {counted(dropped)}"] if dropped else []


class _Frames:
    """Poses (4, 4) of the frames of a model in the model."""

    def __init__(self, model: LineElement, path: Path) -> None:
        self._parts = {str(e.get("name")): e for e in children(model, "link", "joint", "frame")}
        self._poses: dict[str, Floats | None] = {_MODEL: np.eye(4), "world": np.eye(4)}
        self._path = path

    def of(self, name: str) -> Floats:
        """Return the pose of a link, joint or frame."""
        if name not in self._poses:
            part = self._parts.get(name)
            if part is None:
                raise InputError(f"{self._path}: has no link, joint or frame {name}; {_ONE_FILE}")
            self._poses[name] = None
            usual = part.findtext("child") if part.tag == "joint" else part.get("attached_to")
            self._poses[name] = self.pose(part, (usual or _MODEL).strip())
        pose = self._poses[name]
        if pose is None:
            raise InputError(f"{self._path}: frame {name} is relative to itself")
        return pose

    def pose(self, part: Element, usual: str) -> Floats:
        """Return the pose of an element, stated relative to the frame ``usual`` by default."""
        attributes = getattr(part.find("pose"), "attrib", {})
        frame = attributes.get("relative_to") or attributes.get("frame") or usual
        pose = np.eye(4)
        text = part.findtext("pose", "").strip()
        if text:
            is_quaternion = attributes.get("rotation_format") == "quat_xyzw"
            values = numbers(text, 7 if is_quaternion else 6)
            if values is None:
                raise InputError(f"{self._path}: {text}: expected the numbers of a pose")
            is_degrees = attributes.get("degrees") in ("true", "1")
            turn = (
                Rotation.from_quat(values[3:])
                if is_quaternion
                else Rotation.from_euler("xyz", values[3:], degrees=is_degrees)
            )
            pose[:3, :3] = turn.as_matrix()
            pose[:3, 3] = values[:3]
        return self.of(frame) @ pose


def _text(element: Element, tag: str) -> str:
    return (element.findtext(tag) or "").strip()


def _like(original: LineElement, parent: LineElement, tag: str, **attributes: str) -> LineElement:
    """Add an element at the place of the original."""
    urdf_element = added(parent, tag, **attributes)
    urdf_element.line = original.line
    return urdf_element


def _words(values: Floats) -> str:
    return " ".join(repr(float(value)) for value in values)


def _add_origin(parent: LineElement, pose: Floats) -> None:
    rpy = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz")
    added(parent, "origin", xyz=_words(pose[:3, 3]), rpy=_words(rpy))


def _add_link(
    urdf: LineElement, link: LineElement, in_model: _Frames, bases: dict[str, Floats]
) -> None:
    name = str(link.get("name"))
    urdf_element = _like(link, urdf, "link", name=name)
    to_base = np.linalg.inv(bases.setdefault(name, in_model.of(name)))
    inertial = link.find("inertial")
    if inertial is not None and inertial.find("mass") is not None:
        part = added(urdf_element, "inertial")
        _add_origin(part, to_base @ in_model.pose(inertial, name))
        added(part, "mass", value=_text(inertial, "mass"))
        added(part, "inertia", **{e.tag: e.text or "0" for e in inertial.iterfind("inertia/*")})
    for shape in children(link, "visual", "collision"):
        solid = shape.find("geometry/*")
        if solid is None or solid.tag not in _SHAPES:
            continue
        part = _like(shape, urdf_element, shape.tag)
        _add_origin(part, to_base @ in_model.pose(shape, name))
        sizes = {k: _text(solid, tag) or "1 1 1" for k, tag in _SHAPES[solid.tag].items()}
        added(added(part, "geometry"), solid.tag, **sizes)


def _add_axis(
    joint: LineElement, axis: Element, in_model: _Frames, base: Floats, *, is_old: bool
) -> None:
    expressed_in = getattr(axis.find("xyz"), "attrib", {}).get("expressed_in")
    frame = base
    if axis.findtext("use_parent_model_frame", str(is_old)).strip() in ("1", "true", "True"):
        frame = np.eye(4)
    elif expressed_in:
        frame = in_model.of(expressed_in)
    direction = numbers(axis.findtext("xyz"), 3) or [0.0, 0.0, 1.0]
    added(joint, "axis", xyz=_words(base[:3, :3].T @ frame[:3, :3] @ direction))
    if axis.find("mimic") is not None:
        added(joint, "mimic")
    stated = {key: numbers(axis.findtext(f"limit/{key}"), 1) or [np.inf] for key in _LIMITS}
    limits = {key: repr(value) for key, (value,) in stated.items() if abs(value) < _ENDLESS}
    if joint.get("type") == "revolute" and not {"lower", "upper"} <= limits.keys():
        joint.set("type", "continuous")
    added(joint, "limit", **limits)
