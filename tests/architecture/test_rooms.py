"""The folders are the architecture: a room imports only rooms above it, and no files form a circle.

The order is that of ``docs/architecture.md``.
"""

import ast
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import networkx as nx
import pytest

ROOT = Path(__file__).resolve().parents[2]
TOPS = ("config", "drivers", "sim", "controller")

ORDER = {
    "config": ("config",),
    "drivers": (
        *("drivers", "drivers.protocol", "drivers.port", "drivers.bus", "drivers.chain"),
        "drivers.safety",
    ),
    "sim": (
        *("sim", "sim.servo", "sim.line", "sim.faults", "sim.sniff", "sim.ax12", "sim.serve"),
        *("sim.physics", "sim.rendering"),
    ),
    "controller": (
        *("controller.kinematics", "controller.mechanics", "controller.shape"),
        *("controller.terrain", "controller.gaits", "controller.capture", "controller.animal"),
        "controller.mapping",
        *("controller.motion", "controller.walk", "controller.localization"),
        *("controller.repertoire", "controller.runlog", "controller.metrics"),
        *("controller.runtime", "controller.app"),
    ),
}
"""Rooms, from the ground up."""

VOCABULARY = {"types", "clock", "errors", "link", "compiling", "least_squares", "attitude"}
"""What the controller may know of the drivers."""

SAFETY_MUST_NOT_KNOW = ("drivers.bus", "dynamixel_sdk")


def room_of(module: str) -> str:
    """Return the room that a module (dotted, without ``snakewalk``) stands in."""
    parts = module.split(".")
    name = ".".join(parts[:2])
    return name if name in ORDER[parts[0]] else parts[0]


@dataclass(frozen=True)
class Source:
    """What a file says, of what these tests ask; its syntax tree would be kept by the thousand."""

    imported: set[str]
    """Modules and names of ours, and of tests, that it imports, without ``snakewalk``."""
    defined: list[tuple[str, int]]
    """Classes, functions, parameters and attributes, with their lines."""
    classes: list[str]
    """On the file's top level."""


def read_source(text: str) -> Source:
    names: set[str] = set()
    defined: list[tuple[str, int]] = []
    tree = ast.parse(text)
    for node in ast.walk(tree):
        match node:
            case ast.Import():
                names |= {alias.name for alias in node.names}
            case ast.ImportFrom():
                assert node.level == 0, "imports are absolute"
                names |= {f"{node.module}.{alias.name}" for alias in node.names}
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                defined.append((name, node.lineno))
            case ast.Attribute(attr=name, ctx=ast.Store()):
                defined.append((name, node.lineno))
            case ast.AnnAssign(target=ast.Name(id=name)):
                defined.append((name, node.lineno))
    bare = {name for name in names if name.split(".")[0] in TOPS}
    assert not bare, f"top folders are imported as snakewalk.*: {bare}"
    ours = {name.removeprefix("snakewalk.") for name in names if name.startswith("snakewalk.")}
    others = {name for name in names if name.split(".")[0] in {"tests", "dynamixel_sdk"}}
    classes = [node.name for node in tree.body if isinstance(node, ast.ClassDef)]
    return Source(ours | others, defined, classes)


@cache
def sources() -> Mapping[str, Source]:
    """Every module of the rooms (dotted, without ``snakewalk``), read once for all tests."""
    return {
        ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): (
            read_source(file.read_text(encoding="utf-8"))
        )
        for top in TOPS
        for file in sorted((ROOT / top).rglob("*.py"))
    }


def forbidden(module: str, names: Iterable[str]) -> set[str]:
    """Names that a module must not import."""
    top, room = module.split(".", maxsplit=1)[0], room_of(module)
    below = {"config": (), "drivers": ("config",), "sim": ("config", "drivers")}
    may = below.get(top, ("config", "drivers", "sim"))
    wrong = set()
    for name in names:
        to = name.split(".", maxsplit=1)[0]
        if to == "dynamixel_sdk":
            allowed = not module.startswith("drivers.safety")
        elif to not in TOPS:
            allowed = False
        elif to == top:
            allowed = ORDER[top].index(room_of(name)) <= ORDER[top].index(room)
        elif top == "controller" and room != "controller.app" and to != "config":
            allowed = to == "drivers" and name.split(".")[1] in VOCABULARY
        else:
            allowed = to in may
        if module.startswith("drivers.safety") and name.startswith(SAFETY_MUST_NOT_KNOW):
            allowed = False
        if not allowed:
            wrong.add(name)
    return wrong


def module_of(name: str, known: Iterable[str]) -> str | None:
    """Return the module that an imported name lives in."""
    return name if name in known else name.rpartition(".")[0] or None


@pytest.mark.parametrize("top", TOPS)
def test_every_import_points_to_a_room_above(top: str) -> None:
    ours = {m: source for m, source in sources().items() if m.split(".")[0] == top}
    assert ours
    wrong = {m: bad for m, source in ours.items() if (bad := forbidden(m, source.imported))}
    assert wrong == {}


def test_no_files_import_each_other_in_a_circle() -> None:
    ours = sources()
    arrows = nx.DiGraph(
        (m, to)
        for m, source in ours.items()
        for name in source.imported
        if (to := module_of(name, ours)) in ours
    )
    assert list(nx.simple_cycles(arrows)) == []


def test_every_room_is_in_the_order_and_none_is_crowded() -> None:
    files: dict[str, int] = {}
    for module in sources():
        folder = module.rpartition(".")[0] or module
        files[folder] = files.get(folder, 0) + 1
    assert {room: count for room, count in files.items() if count > 24} == {}
    rooms = {".".join(m.split(".")[:2]) for m in sources() if m.count(".") >= 2}
    rooms = {room for room in rooms if not room.startswith("config.")}  # one room with folders
    assert rooms <= {room for order in ORDER.values() for room in order}


def test_the_drawing_of_the_rooms_has_every_room() -> None:
    """It is drawn by hand-picked places: a room without one would end the drawing."""
    drawn = (ROOT / "docs/pictures/tools/rooms.py").read_text(encoding="utf-8")
    missing = [
        room
        for rooms in ORDER.values()
        for room in rooms
        if room != "controller" and f'"{room.replace(".", "/")}": (' not in drawn
    ]
    assert not missing


def test_the_check_catches_a_wrong_arrow() -> None:
    assert forbidden("config.x", {"drivers.types.JointState"})
    assert forbidden("drivers.x", {"sim.line.sim_line"})
    assert forbidden("drivers.protocol.x", {"drivers.bus.budget.Budget"})
    assert forbidden("drivers.safety.x", {"drivers.bus.budget.Budget"})
    assert forbidden("controller.motion.x", {"drivers.bus.dynamixel_bus.DynamixelBus"})
    assert forbidden("controller.shape.x", {"controller.app.cli.main"})
    assert forbidden("controller.kinematics.x", {"controller.motion.source.MotionSource"})
    assert not forbidden("controller.app.runs.x", {"sim.line.sim_line.SimLine"})
    assert not forbidden("controller.motion.x", {"drivers.types.JointState", "config.robot"})
    with pytest.raises(AssertionError, match=r"snakewalk\.\*"):
        read_source("from drivers.types import JointState")
