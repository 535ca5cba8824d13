"""The nearest tests of a change are chosen first, within the budget."""

import networkx as nx
import pytest

from tests.tiers.selection import FILE_S, choose, distances, mirrored_folder

IMPORTS = nx.DiGraph(
    [
        ("controller.run.prepare", "controller.exchange.bag"),
        ("controller.cli.main", "controller.run.prepare"),
        ("tests.helpers.bags", "controller.exchange.bag"),
        ("tests.controller.run.test_prepare", "controller.run.prepare"),
        ("tests.controller.cli.test_main", "controller.cli.main"),
        ("tests.sim.test_line", "tests.helpers.bags"),
    ]
)
TESTS = {
    "tests/controller/exchange/test_table.py": "",
    "tests/controller/run/test_prepare.py": 'load_robot("yaw16")',
    "tests/controller/cli/test_main.py": "",
    "tests/sim/test_line.py": "",
    "tests/config/test_unrelated.py": "",
}


def test_tests_are_as_far_as_their_imports() -> None:
    assert distances(["controller/exchange/bag.py"], IMPORTS, TESTS) == {
        "tests/controller/exchange/test_table.py": 1,  # of the folder that mirrors the package
        "tests/controller/run/test_prepare.py": 2,
        "tests/sim/test_line.py": 2,
        "tests/controller/cli/test_main.py": 3,
    }


def test_a_changed_test_comes_first() -> None:
    changed = ["tests/controller/cli/test_main.py", "controller/exchange/bag.py"]
    assert distances(changed, IMPORTS, TESTS)["tests/controller/cli/test_main.py"] == 0


def test_other_files_concern_the_tests_that_name_them() -> None:
    assert distances(["config/robots/yaw16.toml"], IMPORTS, TESTS) == {
        "tests/controller/run/test_prepare.py": 1,
        "tests/config/test_unrelated.py": 1,  # of the folder that mirrors the package
    }


def test_fixtures_of_a_folder_concern_its_tests() -> None:
    reached = distances(["tests/controller/conftest.py"], IMPORTS, TESTS)
    assert set(reached) == {test for test in TESTS if test.startswith("tests/controller/")}


def test_a_package_without_tests_of_its_name_has_those_of_its_parent() -> None:
    folders = ["tests/controller/exchange", "tests/controller/run"]
    found = mirrored_folder("controller/exchange/robot_import/urdf.py", folders)
    assert found == "tests/controller/exchange"
    assert mirrored_folder("sim/imu.py", folders) is None


def test_the_budget_keeps_the_nearest_and_cheapest() -> None:
    distance = {"changed": 0, "near": 1, "dear": 1, "far": 2}
    cpu_s = {"changed": 50.0, "near": 2.0, "dear": 40.0}
    choice = choose(distance, cpu_s, budget_s=55.0)
    assert choice.chosen == ["changed", "near", "far"]
    assert choice.left_out == ["dear"]
    assert choice.cpu_s == pytest.approx(52.0 + 3 * FILE_S)


def test_a_changed_test_is_chosen_whatever_it_costs() -> None:
    assert choose({"changed": 0}, {"changed": 500.0}, budget_s=75.0).chosen == ["changed"]
