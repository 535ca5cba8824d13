"""Imports follow the order of ``tests/architecture/layout.py``, and no files form a cycle."""

from collections.abc import Iterable

import networkx as nx
import pytest

from tests.architecture.imports import module_imports, read_source, sources
from tests.architecture.layout import (
    BETWEEN_FEATURES,
    CORE,
    FEATURES,
    JOINING,
    MOST_BETWEEN,
    ORDER,
    TOPS,
    VOCABULARY,
    package_of,
)

pytestmark = pytest.mark.costs("reads every source file")

SAFETY_MUST_NOT_KNOW = ("drivers.bus", "dynamixel_sdk")


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
    assert list(nx.simple_cycles(module_imports(sources()))) == []


@pytest.mark.parametrize("level", [1, 2])
def test_no_packages_form_a_cycle(level: int) -> None:
    assert package_cycles(module_imports(sources()), level) == []


def test_few_imports_between_feature_packages() -> None:
    used = {
        (of, to)
        for a, b in module_imports(sources()).edges
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
