"""A robot as the text of its TOML file, which the loader reads back to the same robot."""

import json
from collections.abc import Mapping
from typing import Any

from snakewalk.config.robot import RobotConfig


def robot_toml(robot: RobotConfig, comment: str = "") -> str:
    """Text of a robot's file: what is as by default is left out; ``comment`` stands at the head."""
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    data = robot.model_dump(exclude_defaults=True)
    tables = {key: value for key, value in data.items() if isinstance(value, Mapping)}
    rows = {key: value for key, value in data.items() if _is_rows(value)}
    lines += [_line(k, v) for k, v in data.items() if k not in tables and k not in rows]
    for key, table in tables.items():
        lines += ["", f"[{key}]", *(_line(k, v) for k, v in table.items())]
    for key, several in rows.items():
        for row in several:
            lines += ["", f"[[{key}]]", *(_line(k, v) for k, v in row.items() if v is not None)]
    return "\n".join(lines) + "\n"


def _is_rows(value: Any) -> bool:
    return isinstance(value, tuple | list) and bool(value) and isinstance(value[0], Mapping)


def _line(key: str, value: Any) -> str:
    return f"{key} = {toml_value(value)}"


def toml_value(value: Any) -> str:
    """A value as TOML writes it: text, numbers and lists as JSON does."""
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(toml_value, value))}]"
    return json.dumps(value, ensure_ascii=False)
