"""LeRobot finds the package and reads its configuration; ``make lerobot`` tests the motion.

LeRobot is installed without its dependencies: modules for learning are replaced by empty ones.
"""

import dataclasses
import importlib
import importlib.abc
import importlib.machinery
import importlib.metadata
import importlib.util
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import snakewalk as sw

NEEDED = ("lerobot", "draccus", "mergedeep", "yamlinclude", "toml", "lerobot_robot_snakewalk")
LEARNING = (
    *("torch", "torchvision", "accelerate", "datasets", "einops", "safetensors"),
    *("huggingface_hub", "transformers", "pandas"),
)
OURS = ("lerobot", "draccus", "lerobot_robot_snakewalk", *LEARNING)


class _Unused:
    """A class, function or decorator that is named at import and not used by these tests."""

    def __init__(self, *values: object, **named: object) -> None:
        pass

    def __class_getitem__(cls, item: object) -> type:
        return cls


class _Empty(ModuleType):
    """A package for learning; each of its names is an empty class."""

    __path__: tuple[str, ...] = ()

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(name)
        return type(name, (_Unused,), {})


class _Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds an empty module for each package for learning that is not installed."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: Any = None) -> Any:
        if name.partition(".")[0] in LEARNING:
            return importlib.machinery.ModuleSpec(name, self, is_package=True)
        return None

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType:
        return _Empty(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Leave it empty, but for the folder that LeRobot asks the hub for."""
        if module.__name__ == "huggingface_hub.constants":
            vars(module)["HF_HOME"] = "unused"


@pytest.fixture(scope="module")
def package() -> Iterator[ModuleType]:
    """Import the package as LeRobot does, and forget LeRobot's modules afterwards."""
    clients = str(Path(sys.prefix) / "clients")
    sys.path.append(clients)
    for needed in NEEDED:
        if importlib.util.find_spec(needed) is None:
            sys.path.remove(clients)
            pytest.skip(f"{needed} is not installed; .ci/setup installs it")
    before = dict(sys.modules)
    finder = _Finder()
    sys.meta_path.append(finder)
    sys.modules["lerobot.processor"] = _Empty("lerobot.processor")  # names types, imports learning
    try:
        plugins = importlib.import_module("lerobot.utils.import_utils")
        plugins.register_third_party_plugins()
        assert "lerobot_robot_snakewalk" in sys.modules
        yield sys.modules["lerobot_robot_snakewalk"]
    finally:
        sys.meta_path.remove(finder)
        sys.path.remove(clients)
        for name in [each for each in sys.modules if each.partition(".")[0] in OURS]:
            if name not in before:
                del sys.modules[name]


def test_the_distribution_has_the_name_that_lerobot_looks_for() -> None:
    try:
        about = importlib.metadata.metadata("lerobot_robot_snakewalk")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("lerobot_robot_snakewalk is not installed; .ci/setup installs it")
    assert about["Name"].startswith("lerobot_robot_")


def test_robot_and_teleoperator_are_registered(package: ModuleType) -> None:
    robots = importlib.import_module("lerobot.robots")
    teleoperators = importlib.import_module("lerobot.teleoperators")
    assert robots.RobotConfig.get_choice_class("snakewalk") is package.SnakewalkConfig
    chosen = teleoperators.TeleoperatorConfig.get_choice_class("snakewalk_gait")
    assert chosen is package.SnakewalkGaitConfig


def test_a_command_line_configures_both(package: ModuleType) -> None:
    robots = importlib.import_module("lerobot.robots")
    teleoperators = importlib.import_module("lerobot.teleoperators")
    program = dataclasses.make_dataclass(
        "Program", [("robot", robots.RobotConfig), ("teleop", teleoperators.TeleoperatorConfig)]
    )
    words = [
        *("--robot.type=snakewalk", "--robot.port=/dev/ttyUSB0", "--robot.robot=alternating12"),
        *("--robot.rate_hz=40", "--teleop.type=snakewalk_gait", "--teleop.gait=rolling"),
        "--teleop.params={frequency_hz: 0.5}",
    ]
    config = importlib.import_module("draccus").parse(program, args=words)
    assert config.robot == package.SnakewalkConfig(
        port="/dev/ttyUSB0", robot="alternating12", rate_hz=40.0
    )
    assert config.teleop == package.SnakewalkGaitConfig(
        gait="rolling", params={"frequency_hz": 0.5}
    )


def test_features_are_the_joints(package: ModuleType, tmp_path: Any) -> None:
    make = importlib.import_module("lerobot.robots.utils").make_robot_from_config
    snake = make(package.SnakewalkConfig(port="unused", calibration_dir=tmp_path))
    names = [f"{each}.pos" for each in sw.load_robot("yaw16").joint_names]
    assert list(snake.action_features) == names
    assert list(snake.observation_features)[:16] == names
    assert not snake.is_connected


def test_a_gait_generates_goals_within_the_joints(package: ModuleType, tmp_path: Any) -> None:
    make = importlib.import_module("lerobot.teleoperators.utils").make_teleoperator_from_config
    config = package.SnakewalkGaitConfig(params={"frequency_hz": 0.5}, calibration_dir=tmp_path)
    with make(config) as gait:
        action = gait.get_action()
    assert list(action) == list(gait.action_features)
    limit_rad = sw.load_robot("yaw16").limit_rad
    assert all(abs(goal) <= limit for goal, limit in zip(action.values(), limit_rad, strict=True))


def test_a_gait_that_the_joints_cannot_do_is_rejected(package: ModuleType, tmp_path: Any) -> None:
    with pytest.raises(sw.InputError):
        package.SnakewalkGait(
            package.SnakewalkGaitConfig(gait="sidewinding", calibration_dir=tmp_path)
        )
