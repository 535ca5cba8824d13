"""JSON schemas of Foxglove's well-known messages, made from its package of published messages."""

from functools import cache
from importlib import import_module
from typing import Any, Final

Schema = dict[str, Any]
_WHOLE: Final[Schema] = {"type": "integer"}
_KINDS: Final = {"DOUBLE": "number", "FLOAT": "number", "STRING": "string", "BOOL": "boolean"}
"""JSON types by protobuf's; the others are integers."""


@cache
def foxglove_schema(name: str) -> Schema:
    """Return the schema of a message such as ``foxglove.Log``.

    Foxglove's JSON has all fields but the optional ones; times are ``sec`` and ``nsec``.
    """
    short = name.removeprefix("foxglove.")
    module = import_module(f"foxglove_schemas_protobuf.{short}_pb2")
    return _message(module.DESCRIPTOR.message_types_by_name[short])


def _message(descriptor: Any) -> Schema:
    if descriptor.full_name in {"google.protobuf.Timestamp", "google.protobuf.Duration"}:
        fields = {"sec": _WHOLE, "nsec": _WHOLE}
        title = descriptor.name.lower()
        return {"title": title, "type": "object", "properties": fields, "required": [*fields]}
    return {
        "title": descriptor.full_name,
        "type": "object",
        "properties": {field.name: _field(field) for field in descriptor.fields},
        "required": [field.name for field in descriptor.fields if not _is_optional(field)],
    }


def _is_optional(field: Any) -> bool:
    return field.has_presence and field.message_type is None


def _field(field: Any) -> Schema:
    if field.message_type is not None:
        message = _message(field.message_type)
    else:
        names = {getattr(field, f"CPPTYPE_{name}"): kind for name, kind in _KINDS.items()}
        message = {"type": names.get(field.cpp_type, "integer")}
    return {"type": "array", "items": message} if field.is_repeated else message
