"""JSON schemas of Foxglove's well-known messages, as far as they are written here.

Foxglove goes by a schema's name; its fields are those of its published schemas, which a test
compares with these (github.com/foxglove/foxglove-sdk, ``schemas/``).
"""

from typing import Any, Final

Schema = dict[str, Any]
_NUMBER: Final[Schema] = {"type": "number"}
_TEXT: Final[Schema] = {"type": "string"}
_WHOLE: Final[Schema] = {"type": "integer"}
_TRUTH: Final[Schema] = {"type": "boolean"}


def _object(title: str, **properties: Schema) -> Schema:
    return {
        "title": title,
        "type": "object",
        "properties": properties,
        "required": list(properties),
    }


def _list(items: Schema) -> Schema:
    return {"type": "array", "items": items}


_TIME: Final = _object("time", sec=_WHOLE, nsec=_WHOLE)
_DURATION: Final = _object("duration", sec=_WHOLE, nsec=_WHOLE)
_XYZ: Final = dict.fromkeys(("x", "y", "z"), _NUMBER)
_VECTOR: Final = _object("foxglove.Vector3", **_XYZ)
_POINT: Final = _object("foxglove.Point3", **_XYZ)
_QUATERNION: Final = _object("foxglove.Quaternion", **_XYZ, w=_NUMBER)
_COLOR: Final = _object("foxglove.Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POSE: Final = _object("foxglove.Pose", position=_VECTOR, orientation=_QUATERNION)
_SPHERE: Final = _object("foxglove.SpherePrimitive", pose=_POSE, size=_VECTOR, color=_COLOR)
_CUBE: Final = _object("foxglove.CubePrimitive", pose=_POSE, size=_VECTOR, color=_COLOR)
_CYLINDER: Final = _object(
    "foxglove.CylinderPrimitive",
    pose=_POSE,
    size=_VECTOR,
    bottom_scale=_NUMBER,
    top_scale=_NUMBER,
    color=_COLOR,
)
_LINE: Final = _object(
    "foxglove.LinePrimitive",
    type=_WHOLE,
    pose=_POSE,
    thickness=_NUMBER,
    scale_invariant=_TRUTH,
    points=_list(_POINT),
    color=_COLOR,
    colors=_list(_COLOR),
    indices=_list(_WHOLE),
)
_TRIANGLES: Final = _object(
    "foxglove.TriangleListPrimitive",
    pose=_POSE,
    points=_list(_POINT),
    color=_COLOR,
    colors=_list(_COLOR),
    indices=_list(_WHOLE),
)
_NONE: Final = _list({"type": "object"})
"""A list that is always empty here."""
_ENTITY: Final = _object(
    "foxglove.SceneEntity",
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_DURATION,
    frame_locked=_TRUTH,
    metadata=_NONE,
    arrows=_NONE,
    cubes=_list(_CUBE),
    spheres=_list(_SPHERE),
    cylinders=_list(_CYLINDER),
    lines=_list(_LINE),
    triangles=_list(_TRIANGLES),
    texts=_NONE,
    models=_NONE,
)
_JOINT: Final = _object("foxglove.JointState", name=_TEXT) | {
    "properties": {
        "name": _TEXT,
        "position": _NUMBER,
        "velocity": _NUMBER,
        "effort": _NUMBER,
    }
}
"""Only the name must be there; what is not known is left out."""
_TRANSFORM: Final = _object(
    "foxglove.FrameTransform",
    timestamp=_TIME,
    parent_frame_id=_TEXT,
    child_frame_id=_TEXT,
    translation=_VECTOR,
    rotation=_QUATERNION,
)
SCHEMAS: Final = {
    schema["title"]: schema
    for schema in (
        _object("foxglove.SceneUpdate", deletions=_NONE, entities=_list(_ENTITY)),
        _object("foxglove.FrameTransforms", transforms=_list(_TRANSFORM)),
        _object("foxglove.JointStates", timestamp=_TIME, joints=_list(_JOINT)),
        _object("foxglove.PoseInFrame", timestamp=_TIME, frame_id=_TEXT, pose=_POSE),
        _object(
            "foxglove.Log",
            timestamp=_TIME,
            level=_WHOLE,
            message=_TEXT,
            name=_TEXT,
            file=_TEXT,
            line=_WHOLE,
        ),
    )
}
"""By name."""
