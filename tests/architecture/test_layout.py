"""Imports follow the order of ``tests/architecture/layout.py``, and no files form a cycle."""

import ast
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import networkx as nx
import pytest

from tests.architecture.layout import (
    BETWEEN_FEATURES,
    CORE,
    FEATURES,
    JOINING,
    MOST_BETWEEN,
    ORDER,
    TOPS,
    VOCABULARY,
)

ROOT = Path(__file__).resolve().parents[2]
SAFETY_MUST_NOT_KNOW = ("drivers.bus", "dynamixel_sdk")


def package_of(module: str) -> str:
    """Return the package of a module (dotted, without ``snakewalk``)."""
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
    """Every module of the packages (dotted, without ``snakewalk``), read once for all tests."""
    return {
        ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): (
            read_source(file.read_text(encoding="utf-8"))
        )
        for top in TOPS
        for file in sorted((ROOT / top).rglob("*.py"))
    }


def is_upward(module: str, name: str) -> bool:
    """Return whether an import between two packages of the controller breaks their order."""
    of, to = package_of(module).split(".")[-1], package_of(name).split(".")[-1]
    if of == to:
        return False
    if of in FEATURES:
        return not (of == "cli" or to in CORE or (of, to) in BETWEEN_FEATURES)
    return to not in CORE or CORE.index(to) > CORE.index(of)


def forbidden(module: str, names: Iterable[str]) -> set[str]:
    """Return the names that a module must not import."""
    top, package = module.split(".", maxsplit=1)[0], package_of(module)
    joins = package.split(".")[-1] in JOINING
    below = {"config": (), "drivers": ("config",), "sim": ("config", "drivers")}
    may = below.get(top, ("config", "drivers", "sim"))
    wrong = set()
    for name in names:
        to = name.split(".", maxsplit=1)[0]
        if to == "dynamixel_sdk":
            allowed = not module.startswith("drivers.safety")
        elif to not in TOPS:
            allowed = False
        elif to == top == "controller":
            allowed = not is_upward(module, name)
        elif to == top:
            allowed = ORDER[top].index(package_of(name)) <= ORDER[top].index(package)
        elif top == "controller" and not joins and to != "config":
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


def module_imports() -> nx.DiGraph:
    """Return the imports from module to module."""
    ours = sources()
    return nx.DiGraph(
        (m, to)
        for m, source in ours.items()
        for name in source.imported
        if (to := module_of(name, ours)) in ours and to != m
    )


def package_cycles(imports: nx.DiGraph, level: int) -> list[list[str]]:
    """Return the cycles between packages, taking modules apart at ``level`` dots."""

    def package(module: str) -> str:
        return ".".join(module.split(".")[:-1][: level + 1]) or module

    arrows = nx.DiGraph(
        (package(a), package(b))
        for a, b in imports.edges
        if package(a) != package(b)
        and not package(a).startswith(f"{package(b)}.")
        and not package(b).startswith(f"{package(a)}.")
    )
    return [list(cycle) for cycle in nx.simple_cycles(arrows, length_bound=6)]


@pytest.mark.parametrize("top", TOPS)
def test_every_import_points_to_a_package_above(top: str) -> None:
    ours = {m: source for m, source in sources().items() if m.split(".")[0] == top}
    assert ours
    wrong = {m: bad for m, source in ours.items() if (bad := forbidden(m, source.imported))}
    assert wrong == {}


def test_no_files_form_a_cycle() -> None:
    assert list(nx.simple_cycles(module_imports())) == []


@pytest.mark.parametrize("level", [1, 2])
def test_no_packages_form_a_cycle(level: int) -> None:
    assert package_cycles(module_imports(), level) == []


def test_few_imports_between_feature_packages() -> None:
    used = {
        (of, to)
        for a, b in module_imports().edges
        if a.startswith("controller.") and b.startswith("controller.")
        for of, to in [(a.split(".")[1], b.split(".")[1])]
        if of != to and of in FEATURES and to in FEATURES and of != "cli"
    }
    assert set(BETWEEN_FEATURES) <= used, "a listed import is gone: remove it from the list"
    assert len(BETWEEN_FEATURES) <= MOST_BETWEEN
    assert all(reason for reason in BETWEEN_FEATURES.values())


def test_every_package_is_in_the_order_and_none_is_crowded() -> None:
    files: dict[str, int] = {}
    for module in sources():
        folder = module.rpartition(".")[0] or module
        if module.count(".") > 1 or folder not in TOPS:
            files[folder] = files.get(folder, 0) + 1
    assert {folder: count for folder, count in files.items() if count > 24} == {}
    packages = {".".join(m.split(".")[:2]) for m in sources() if m.count(".") >= 2}
    packages = {each for each in packages if not each.startswith("config.")}  # one, with folders
    assert packages <= {package for order in ORDER.values() for package in order}


def test_the_checks_catch_planted_imports() -> None:
    assert forbidden("config.x", {"drivers.types.JointState"})
    assert forbidden("drivers.x", {"sim.line.sim_line"})
    assert forbidden("drivers.protocol.x", {"drivers.bus.budget.Budget"})
    assert forbidden("drivers.safety.x", {"drivers.bus.budget.Budget"})
    assert forbidden("controller.motion.x", {"drivers.bus.dynamixel_bus.DynamixelBus"})
    assert forbidden("controller.shape.x", {"controller.cli.main"})
    assert forbidden("controller.kinematics.x", {"controller.motion.source.MotionSource"})
    assert forbidden("controller.run.x", {"controller.studies.trials.trials"}), "upward"
    assert forbidden("controller.bench.x", {"controller.ros.ros_node.serve"}), "not listed"
    assert not forbidden("controller.run.x", {"sim.line.sim_line.SimLine"})
    assert not forbidden("controller.motion.x", {"drivers.types.JointState", "config.robot"})
    with pytest.raises(AssertionError, match=r"snakewalk\.\*"):
        read_source("from drivers.types import JointState")


def test_the_checks_catch_a_planted_cycle() -> None:
    imports = nx.DiGraph(
        [("controller.bench.a", "controller.ros.b"), ("controller.ros.c", "controller.bench.d")]
    )
    assert package_cycles(imports, 1) == [["controller.bench", "controller.ros"]] or package_cycles(
        imports, 1
    ) == [["controller.ros", "controller.bench"]]
    within = nx.DiGraph(
        [("controller.x.a.f", "controller.x.b.g"), ("controller.x.b.h", "controller.x.a.i")]
    )
    assert package_cycles(within, 1) == []
    assert len(package_cycles(within, 2)) == 1
