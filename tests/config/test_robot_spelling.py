"""One robot has one configuration, however its file spells it, and code reads only that."""

import ast
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.loader import digest, load_robot, shipped, with_keys
from snakewalk.config.robot import BellyConfig, JointConfig, LinkConfig, RobotConfig
from snakewalk.config.robot.keys import READ_INSTEAD
from snakewalk.config.template import plain_toml
from tests.helpers.uneven import UNEVEN

ROOT = Path(__file__).resolve().parents[2]
CASES = Path(__file__).parent / "two_spellings"
TOPS = ("config", "drivers", "sim", "controller", "benchmarks", "examples", "tests")


def fully_spelt(robot: RobotConfig) -> dict[str, object]:
    """Keys of the same robot with every value in `[[links]]` and `[[joints]]`."""
    links = zip(
        *(robot.link_lengths_m, robot.bare_link_masses_kg, robot.link_radii_m, robot.link_shapes),
        strict=True,
    )
    joints = [
        JointConfig(
            id=robot.servo_ids[k],
            model=robot.servo_models[k],
            sign=robot.signs[k],
            zero_rad=robot.zeros_rad[k],
            limit_rad=robot.limit_rad[k],
            position_p_gain=robot.position_p_gains[k],
            position_i_gain=robot.position_i_gains[k],
            position_d_gain=robot.position_d_gains[k],
            current_limit_a=robot.current_limits_a[k] if axis == "p" else None,
            armature_kg_m2=robot.armatures_kg_m2[k],
            gear_drag_n_m_s=robot.gear_drags_n_m_s[k],
        )
        for k, axis in enumerate(robot.all_axes)
    ]
    return robot.model_dump() | {
        "links": [
            LinkConfig(length_m=length, mass_kg=mass, radius_m=radius, shape=shape).model_dump()
            for length, mass, radius, shape in links
        ],
        "joints": [joint.model_dump() for joint in joints],
    }


def drawn_robot(seed: int) -> RobotConfig:
    """Draw a robot whose links and joints differ, by a file that names few of them."""
    rng = np.random.default_rng(seed)
    axes = "".join(rng.choice(["y", "p"], 6))
    few = rng.random(7) < 0.4
    links = [
        LinkConfig(
            length_m=float(rng.choice([0.03, 0.05])) if own else None,
            mass_kg=float(rng.choice([0.02, 0.3])) if own else None,
            radius_m=float(rng.choice([0.01, 0.02])) if own and k else None,
            shape="ball" if own and rng.random() < 0.5 else None,
        )
        for k, own in enumerate(few)
    ]
    joints = [
        JointConfig(
            id=int(100 + k) if rng.random() < 0.3 else None,
            model="XM430-W210" if rng.random() < 0.3 else None,
            sign=1 if rng.random() < 0.5 else -1,
            limit_rad=float(rng.choice([0.5, 0.9])) if rng.random() < 0.5 else None,
            position_p_gain=int(rng.choice([300, 500])) if rng.random() < 0.5 else None,
            current_limit_a=0.3 if axis == "p" and rng.random() < 0.5 else None,
        )
        for k, axis in enumerate(axes)
    ]
    return RobotConfig(
        name="drawn", joint_axes=axes, links=tuple(links), joints=tuple(joints), link_length_m=0.04
    )


ROBOTS = [
    *(load_robot(name) for name in shipped("robots")),
    RobotConfig.model_validate(UNEVEN.model_dump()),
    *(drawn_robot(seed) for seed in range(20)),
]


def test_the_two_files_are_one_robot() -> None:
    scalar, spelt = (load_robot(str(CASES / name)) for name in ("a.toml", "b.toml"))
    assert spelt == scalar
    assert spelt.model_dump_json() == scalar.model_dump_json()
    assert digest(spelt) == digest(scalar)
    assert plain_toml(spelt) == plain_toml(scalar)
    assert spelt.link_lengths_m == (0.03,) * 17
    longer = [with_keys(robot, {"link_length_m": 0.05}, "--set") for robot in (scalar, spelt)]
    assert longer[0] == longer[1]
    assert longer[1].length_m == pytest.approx(0.85)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_a_robot_whose_file_says_everything_is_the_same(robot: RobotConfig) -> None:
    spelt = RobotConfig.model_validate(fully_spelt(robot))
    assert spelt == robot
    for name in ("servo_ids", "servo_models", "limit_rad", "signs", "zeros_rad", "motors"):
        assert getattr(spelt, name) == getattr(robot, name)
    assert spelt.link_lengths_m == robot.link_lengths_m
    assert spelt.link_masses_kg == robot.link_masses_kg
    assert RobotConfig.model_validate_json(robot.model_dump_json()) == robot


def test_values_of_the_links_survive_the_spelling() -> None:
    lengths_m = (0.12, 0.0, 0.08, 0.0, 0.08, 0.0, 0.08, 0.0, 0.08, 0.0, 0.15)
    robot = RobotConfig.model_validate(UNEVEN.model_dump())
    assert robot.link_lengths_m == lengths_m
    assert robot.link_shapes == UNEVEN.link_shapes
    assert robot.link_masses_kg == UNEVEN.link_masses_kg
    assert robot.centre_distance_m == pytest.approx(sum(lengths_m) - 0.06 - 0.075)


def test_rails_of_single_links_are_those_of_the_belly() -> None:
    belly = BellyConfig(shape="rails", width_m=0.1)
    rails = (LinkConfig(shape="rails"), *(LinkConfig(shape="ball"),) * 2)
    robot = RobotConfig(name="sledge", joint_axes="yy", belly=belly, links=rails)
    assert robot.belly == belly
    assert robot.link_shapes == ("rails", "ball", "ball")


def test_a_motors_constants_stay_with_their_model() -> None:
    motor = {"torque_constant_n_m_a": 1.5}
    robot = RobotConfig.model_validate(
        {
            "name": "mixed",
            "joint_axes": "yyy",
            "servo": {"motor": motor},
            "joints": [{}, {"model": "XM430-W210"}, {"model": "XM430-W210"}],
        }
    )
    assert [each is not None for each in robot.motors] == [True, False, False]
    other = RobotConfig.model_validate(
        robot.model_dump() | {"joints": [{"model": "XM430-W210"} for _ in range(3)]}
    )
    assert other.motors == (None, None, None)
    assert other.servo.model == "XM430-W210"


@pytest.mark.parametrize("key", READ_INSTEAD)
def test_the_chains_value_cannot_be_read(key: str) -> None:
    robot = load_robot("yaw16")
    with pytest.raises(AttributeError, match=f"read {READ_INSTEAD[key]}"):
        getattr(robot, key)
    assert key in robot.model_dump()
    assert key in RobotConfig.model_fields


PLANT = {"pair", "m", "self._m", "mechanics"}
"""Objects with an attribute of the same name: a pair of legs, and the arrays of the physics."""


def texts(tops: tuple[str, ...]) -> dict[Path, str]:
    """Text of each source file."""
    paths = [path for top in tops for path in sorted((ROOT / top).rglob("*.py"))]
    return {path: path.read_text(encoding="utf-8") for path in paths}


def reads_of_parsed_keys(text: str) -> list[str]:
    """Attributes that a source reads from something that may be a robot."""
    if not any(f".{key}" in text for key in READ_INSTEAD):
        return []
    return [
        f"{node.lineno}: {node.attr}"
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Attribute)
        and node.attr in READ_INSTEAD
        and isinstance(node.ctx, ast.Load)
        and ast.unparse(node.value) not in PLANT
    ]


def test_no_code_reads_a_parsed_key_of_the_chain() -> None:
    """A read raises when it runs; this finds those that no test runs."""
    found = {str(path): reads_of_parsed_keys(text) for path, text in texts(TOPS).items()}
    found = {path: reads for path, reads in found.items() if reads}
    assert found == {}
    assert reads_of_parsed_keys("length_m = robot.link_length_m") == ["1: link_length_m"]
    outside = [
        str(path)
        for path, text in texts(TOPS[:4]).items()
        if "keys import parsed" in text and path.parent != ROOT / "config/robot"
    ]
    assert outside == []
