"""The configuration reference, from the schema: ``python -m snakewalk.config.document``.

It also makes the JSON Schema, with which editors complete and check files.
"""

from collections.abc import Mapping
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from snakewalk.config.animal import AnimalConfig, SkinConfig
from snakewalk.config.faults import FaultPlan
from snakewalk.config.field_facts import bounds_in, bounds_text, description_of
from snakewalk.config.gait import GaitSetConfig
from snakewalk.config.recording import RecordingConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.schedule import ScheduleConfig
from snakewalk.config.servo_model import ServoModel
from snakewalk.config.synthesis import SynthesisConfig
from snakewalk.config.world import WorldConfig

SCHEMAS: Mapping[str, type[BaseModel]] = {
    "run": RunConfig,
    "robot": RobotConfig,
    "world": WorldConfig,
    "synthesis": SynthesisConfig,
    "gait": GaitSetConfig,
    "recording": RecordingConfig,
    "skin": SkinConfig,
    "animal": AnimalConfig,
    "schedule": ScheduleConfig,
    "faults": FaultPlan,
    "servo": ServoModel,
}
"""Schemas by the names of their files; a synthesis is also a table of a run."""

WRITTEN_BY_PROGRAM = ("described_models",)
"""Keys that the program fills when it loads a file; no page or template shows them."""
_HEAD = """# Configuration

A run is a TOML file that names a robot and a world; each is a shipped name or a path ending in
`.toml` (relative to the file that names it). `snakewalk list` shows what is shipped, and
each file in `config/runs`, `config/robots` and `config/worlds` begins with its
description. Unknown keys, wrong types and values out of range are reported all at once, one line
each, with exit code 2.

```
# my-run.toml
name = "my-run"
robot = "my-robot.toml"
world = "flat"
waypoints_m = [[1, 0], [2, 1]]
seed = 3

[behaviour]
pulse_body_lengths_s = 0.2
```

```
# my-robot.toml
name = "mine"
joint_axes = "yyyyyyyyyyyy"
link_length_m = 0.045
body_radius_m = 0.02
link_mass_kg = 0.03
torque_limit_n_m = 0.25

[servo]
model = "XL330-M288"
supply_v = 5.0
armature_kg_m2 = 0.002
gear_drag_n_m_s = 0.006
```

`snakewalk init mine` writes a run, a robot and a world to change, each with every key, its
default and its meaning (`--robot`, `--from RUN`: like another one), and `snakewalk run
mine/run.toml` runs them as they are.

**In an editor.** `snakewalk tools schema run` (`robot`, `world`, `synthesis`, `gait`, `recording`,
`skin`, `animal`, `schedule`, `faults`, `servo`, `policy`) prints the JSON Schema of such a file.
`init` writes those of its three files into `mine/schema/` and names them in each file's first line,
`#:schema schema/run.json`. With it the extension *Even Better TOML* of VS Code completes keys,
shows their meaning and marks errors, and so does `taplo check run.toml` on a command line.
For files elsewhere write a `.taplo.toml`:

```
[[rule]]
include = ["robots/*.toml"]
schema.path = "schema/robot.json"
```

`snakewalk plan` checks rules that involve several keys (a walk needs waypoints, IDs differ).

Units are in the names: `_m`, `_rad`, `_s`, `_a` (ampere), `_v`, `_c` (Celsius), `_kg`, `_n_m`.
This page is written from the schema by `python -m snakewalk.config.document`; a test keeps it true.
"""


_FILES = (
    ("Run", RunConfig),
    ("Robot", RobotConfig),
    ("World", WorldConfig),
    ("Servo model", ServoModel),
)


def reference() -> str:
    """Markdown of every table and key."""
    parts = [_HEAD]
    for title, model in _FILES:
        parts += _tables(title, model)
    return "\n".join(parts).rstrip() + "\n"


def json_schema(kind: str, model: type[BaseModel] | None = None) -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a kind of file: keys, types, ranges, descriptions.

    Only the loader checks rules that involve several keys. ``model`` is the schema of a file that a
    higher package reads.
    """
    model = model or SCHEMAS[kind]
    schema = model.model_json_schema()
    if model is ServoModel:  # the other keys may come from the model that it is like
        schema["required"] = ["model", "model_number", "source"]
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"snakewalk: {kind}",
        "description": (model.__doc__ or "").partition("\n")[0],
    }
    return schema | head


def _tables(title: str, model: type[BaseModel]) -> list[str]:
    lines = [
        f"## {title}",
        "",
        (model.__doc__ or "").strip().partition("\n")[0],
        "",
        "| key | value | default | |",
        "|---|---|---|---|",
    ]
    inner: list[str] = []
    for name, field in model.model_fields.items():
        if name in WRITTEN_BY_PROGRAM:
            continue
        nested = table_models(field.annotation)
        row = row_model(field.annotation)
        if row is not None:
            place = _title(title, name, row, 1).replace("`[", "`[[").replace("]`", "]]`")
            inner += _tables(place, row)
        elif nested:
            for nested_model in nested:
                inner += _tables(_title(title, name, nested_model, len(nested)), nested_model)
            continue
        default = "required" if field.is_required() else f"`{_text(field.default)}`"
        lines.append(f"| `{name}` | {value_kind(field)} | {default} | {description_of(field)} |")
    return [*lines, "", *inner]


def row_model(annotation: Any) -> type[BaseModel] | None:
    """Row schema of a key that is a list of tables, or None."""
    if get_origin(annotation) is not tuple:
        return None
    return next(iter(table_models(get_args(annotation)[0])), None)


def _title(title: str, name: str, model: type[BaseModel], choices: int) -> str:
    top, _, outer = title.partition(": ")
    table = f"{outer.strip('[]`')}.{name}" if outer.startswith("`[") else name
    place = f"{top}: `[{table}]`"
    if choices == 1:
        return place
    return f'{place} with `kind = "{_text(model.model_fields["kind"].default)}"`'


def table_models(annotation: Any) -> list[type[BaseModel]]:
    """Schemas of the tables of a key."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if get_origin(annotation) is Annotated:
        return table_models(get_args(annotation)[0])
    if get_origin(annotation) in {Union, UnionType}:
        return [model for part in get_args(annotation) for model in table_models(part)]
    return []


def _kind(annotation: Any) -> str:
    if get_origin(annotation) is Annotated:
        inner, *rules = get_args(annotation)
        bounds = [
            bounds_text(bounds_in(rule.metadata)) for rule in rules if isinstance(rule, FieldInfo)
        ]
        return _kind(inner) + "".join(f" ({bound})" for bound in bounds if bound)
    if get_origin(annotation) is Literal:
        return " or ".join(f"`{value}`" for value in get_args(annotation))
    if get_origin(annotation) in {Union, UnionType}:
        return " or ".join(_kind(a) for a in get_args(annotation) if a is not type(None))
    if get_origin(annotation) is tuple:
        inner = [_kind(a) for a in get_args(annotation) if a is not Ellipsis]
        return (
            f"list of {inner[0]}" if Ellipsis in get_args(annotation) else f"[{', '.join(inner)}]"
        )
    if get_origin(annotation) is dict:
        return "table"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "table"
    names = {float: "number", int: "whole number", str: "text", bool: "true or false"}
    return names.get(annotation, str(annotation))


def value_kind(field: FieldInfo) -> str:
    """Kind and bounds of a key's value, as text."""
    bounds = bounds_text(bounds_in(field.metadata))
    return f"{_kind(field.annotation)}{bounds and ', '}{bounds}"


def _text(value: Any) -> str:
    if value is None or value is PydanticUndefined:
        return "none"
    if isinstance(value, tuple):
        return f"[{', '.join(map(_text, value))}]"
    return str(value)


if __name__ == "__main__":
    print(reference(), end="")
