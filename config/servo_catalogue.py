"""Servo models by name, by number or by file."""

from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from snakewalk.config.errors import ConfigError
from snakewalk.config.near_names import name_hint
from snakewalk.config.servo_model import ServoModel
from snakewalk.config.strict_toml import checked, read_toml

FOLDER = Path(__file__).parent / "servos"
"""Folder with a file for each shipped servo model."""
_MISTYPED = 0.8
"""Likeness of two names from which one counts as mistyped (ours)."""
_MOST_FILES = 5
"""Longest chain of files that are each like the next (ours)."""


def printed_name(name: str) -> str:
    """Name of a model as printed on the servo: capitals, ``-`` for ``_``."""
    return name.removesuffix(".model").upper().replace("_", "-")


@cache
def shipped_models() -> tuple[str, ...]:
    """Sorted names of the shipped models."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def servo_model(name_or_path: str, folder: Path | None = None) -> ServoModel:
    """Model of a shipped name, in any case, or of a ``.toml`` file.

    A path is relative to ``folder`` (the folder of the naming file) if the file is there. A name
    that is not shipped is searched in its folder ``servos``.

    Raises:
        ConfigError: the model is unknown; or the faults of its file, one line each.

    """
    path = model_file(name_or_path, folder)
    if path is None:
        shipped = shipped_models()
        name = name_or_path.upper()
        series = [
            model_name for model_name in shipped if model_name.startswith(name[:2])
        ] or shipped
        near = ", ".join(get_close_matches(name, series, 5, 0.2))
        similar = f"similar are {near} ({len(shipped)} are in {FOLDER}); " if near else ""
        raise ConfigError(
            f"{name_or_path}: no such servo model; {similar}describe another one in a file: "
            "docs/how-to/add-a-servo-model.md"
        )
    return _shipped_model(path.stem) if path.parent == FOLDER else _read(path)


def model_file(name_or_path: str, start_folder: Path | None) -> Path | None:
    """File of a model by the rules of ``servo_model``, or None."""
    folders = [] if start_folder is None else [start_folder]
    if name_or_path.endswith(".toml"):
        candidates = [folder / name_or_path for folder in folders] + [Path(name_or_path)]
    else:
        folder_files = [folder / "servos" / f"{name_or_path}.toml" for folder in folders]
        candidates = [FOLDER / f"{printed_name(name_or_path)}.toml", *folder_files]
    return next((path for path in candidates if path.is_file()), None)


def described_model(name_or_path: str, folder: Path | None) -> ServoModel | None:
    """Model of a file that is not shipped; None for a shipped model's name.

    Raises:
        ConfigError: the faults of the file.

    """
    path = model_file(name_or_path, folder)
    if path is None and name_or_path.endswith(".toml"):
        raise ConfigError(f"{name_or_path}: no such file")
    return None if path is None or path.parent == FOLDER else _read(path)


def models_by_number(folder: Path | None = None, protocol: int | str = 2) -> Mapping[int, str]:
    """Names of the known models of a protocol by model number.

    ``folder`` adds those in its folder ``servos``. If shipped models share a number, the first by
    name is listed.

    Raises:
        ConfigError: the faults of such a file.

    """
    files = [] if folder is None else sorted((folder / "servos").glob("*.toml"))
    shipped = _shipped_by_number(protocol)
    if not files:
        return shipped
    folder_models = [_read(path) for path in files]
    return {**shipped, **{m.model_number: m.model for m in folder_models if m.protocol == protocol}}


@cache
def _shipped_by_number(protocol: int | str) -> Mapping[int, str]:
    numbers: dict[int, str] = {}
    for name in shipped_models():
        model = _shipped_data(name)[0]  # a schema is slower
        if model.get("protocol", 2) == protocol:
            numbers.setdefault(model["model_number"], name)
    return MappingProxyType(numbers)


@cache
def _shipped_model(name: str) -> ServoModel:
    data, text = _shipped_data(name)
    return checked(ServoModel, data, str(FOLDER / f"{name}.toml"), text)


@cache
def _shipped_data(name: str) -> tuple[dict[str, Any], str]:
    path = FOLDER / f"{name}.toml"
    data, text = read_toml(path)
    return _merged_with_like(path, data, 1), text


def _read(path: Path) -> ServoModel:
    data, text = read_toml(path)
    model = checked(ServoModel, _merged_with_like(path, data, 1), str(path), text)
    known = {row for name in shipped_models() for row in _shipped_data(name)[0]["registers"]}
    for row in model.registers.keys() - known:
        if near := get_close_matches(row, known - model.registers.keys(), 1, _MISTYPED):
            raise ConfigError(f"{path}: registers: no model has {row}; did you mean {near[0]}?")
    return model


def _merged_with_like(path: Path, data: dict[str, Any], depth: int) -> dict[str, Any]:
    """Data of a file over those of the model in ``like``.

    Raises:
        ConfigError: the other model does not exist, or lacks a register of ``without``.

    """
    table = dict(data)
    like = table.pop("like", None)
    without = table.pop("without", [])
    if like is None and not without:
        return table
    if not isinstance(like, str):
        raise ConfigError(f"{path}: like: must name a model, or a file")
    if not (isinstance(without, list) and all(isinstance(name, str) for name in without)):
        raise ConfigError(f"{path}: without: must be a list of registers")
    other = model_file(like, path.parent)
    if other is None:
        raise ConfigError(f"{path}: like: {like}: no such servo model")
    if depth == _MOST_FILES:
        raise ConfigError(f"{path}: like: more than {_MOST_FILES} files that are each like another")
    base = dict(
        _shipped_data(other.stem)[0]
        if other.parent == FOLDER
        else _merged_with_like(other, read_toml(other)[0], depth + 1)
    )
    registers = dict(base.get("registers", {}))
    rows = table.get("registers")
    changed = []
    if isinstance(rows, dict):  # a row without an address changes a register of the other model
        changed = [n for n, row in rows.items() if isinstance(row, dict) and "address" not in row]
    for name in (*without, *changed):
        if name not in registers:
            hint = name_hint(name, registers)
            raise ConfigError(f"{path}: {like} has no register {name!r}{hint}")
    base["registers"] = {name: row for name, row in registers.items() if name not in without}
    for key in ("source", "friction"):  # they belong to the other model
        base.pop(key, None)
    return _with_changes(base, table)


def _with_changes(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Values of ``changes`` over those of ``base``, table by table."""
    merged = dict(base)
    for key, value in changes.items():
        below = merged.get(key)
        is_table = isinstance(value, dict) and isinstance(below, dict)
        merged[key] = _with_changes(dict(below or {}), value) if is_table else value
    return merged
