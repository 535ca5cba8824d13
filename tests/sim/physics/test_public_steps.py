"""The private interface of MuJoCo: its check, and the public fallback with the same bits."""

from collections.abc import Iterator

import mujoco
import numpy as np
import pytest
from packaging.version import Version
from pytest_mock import MockerFixture

from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_robot, load_world
from snakewalk.drivers import fallbacks
from snakewalk.drivers.fallbacks import ENVIRONMENT, fallbacks_in_use
from snakewalk.sim.physics import layout
from snakewalk.sim.physics.layout import StepLayout, step_layout
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.physics.public_steps import PublicSteps
from snakewalk.sim.physics.stepper import CompiledSteps
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad

_LAYOUT = step_layout()
IS_COMPILED = isinstance(_LAYOUT, StepLayout)
HAS_PARTS = isinstance(_LAYOUT, StepLayout) and _LAYOUT.has_parts
compiled_here = pytest.mark.skipif(not IS_COMPILED, reason="an old MuJoCo: public steps only")
parts_here = pytest.mark.skipif(not HAS_PARTS, reason="an old MuJoCo: no steps by parts")
CASES = [
    ("yaw16", "flat"),
    ("alternating16", "random-10"),
    ("salamander", "random-10"),
    ("xl330-16", "flat"),
    ("yaw16", "pegs"),
    ("yaw16", "pool"),
]


@pytest.fixture(autouse=True)
def checked_again(mocker: MockerFixture) -> Iterator[None]:
    """The check runs again in each test, and nothing was reported before."""
    mocker.patch.dict(fallbacks._reported_fallbacks, clear=True)
    step_layout.cache_clear()
    yield
    step_layout.cache_clear()


def moved(robot_name: str, world_name: str, kind: type) -> list[bytes]:
    """Run a wave for 0.4 s; everything that the steps write."""
    robot, world = load_robot(robot_name), load_world(world_name)
    plant = MujocoPlant(robot, world, build_ground(world))
    assert type(plant.steps) is kind
    plant.reset((0.0, 0.0), 0.0, np.zeros(robot.joint_count))
    motors = [MOTORS[model] for model in robot.servo_models]
    drive = make_drive(motors, robot.servo.supply_v)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = [p_gain_per_rad(400, motor) for motor in motors]
    for k in range(20):
        drive.goal_rad[:] = 0.03 * k * np.sin(0.2 * k - np.arange(robot.joint_count) / 2.2)
        plant.advance(0.02 * (k + 1), drive)
    m = plant.mechanics
    arrays = plant.qpos, m.data.qvel, m.load_n, m.before_m, m.totals, m.model.dof_frictionloss
    return [each.tobytes() for each in (*arrays, *drive.columns())]


@pytest.mark.slow
@pytest.mark.costs("runs the uncompiled public interface for comparison")
@compiled_here
@pytest.mark.parametrize(("robot", "world"), CASES)
def test_the_public_steps_have_the_bits_of_the_compiled_ones(
    robot: str, world: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = moved(robot, world, CompiledSteps)
    monkeypatch.setenv(ENVIRONMENT, "mujoco")
    step_layout.cache_clear()
    assert moved(robot, world, PublicSteps) == usual


def test_versions_that_ci_runs_are_compiled() -> None:
    """A skipped test above hides nothing on the versions that ``make`` installs."""
    assert HAS_PARTS or Version(mujoco.__version__) < Version("3.17")
    assert IS_COMPILED or Version(mujoco.__version__) < Version("3.3")


def test_the_public_steps_are_reported_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv(ENVIRONMENT, "numba, mujoco")
    for _ in range(2):
        MujocoPlant(load_robot("yaw16"), load_world("flat"))
    (text,) = fallbacks_in_use()
    assert [record.getMessage() for record in caplog.records] == [text]
    assert "public interface" in text
    assert "install mujoco" in text


@compiled_here
@pytest.mark.parametrize(
    ("field", "error"),
    [("ncon", "describes"), ("efc_force", "describes"), ("qvel", "describes")],
)
def test_a_moved_field_is_found(field: str, error: str, mocker: MockerFixture) -> None:
    """A description with one field in another place than in memory."""
    described, arrays = layout._mujoco_layout()
    if field in arrays:
        arrays = {**arrays, field: arrays[field] + 8}
    wrong = {**described.data, field: described.data.get(field, 0) + 8}
    moved_field = StepLayout(wrong, described.contact, described.functions)
    mocker.patch.object(layout, "_mujoco_layout", return_value=(moved_field, arrays))
    found = step_layout()
    assert isinstance(found, str)
    assert error in found


def test_a_mujoco_without_a_description_is_stepped_in_public(mocker: MockerFixture) -> None:
    mocker.patch.dict("sys.modules", {"mujoco.introspect": None})
    assert step_layout() == "it does not describe its memory"
    plant = MujocoPlant(load_robot("yaw16"), load_world("flat"))
    assert isinstance(plant.steps, PublicSteps)


@parts_here
@pytest.mark.parametrize("missing", ["mj_checkVel", "mj_comPos", "mj_fwdVelocity"])
def test_parts_that_step_otherwise_than_mujoco_are_not_used(
    missing: str, mocker: MockerFixture
) -> None:
    """One of the parts does something else than its name says."""
    described, arrays = layout._mujoco_layout()
    other = described.functions["mj_projectConstraint"]
    functions = {**described.functions, missing: other}
    changed = StepLayout(described.data, described.contact, functions)
    mocker.patch.object(layout, "_mujoco_layout", return_value=(changed, arrays))
    found = step_layout()
    assert isinstance(found, StepLayout)
    assert not found.has_parts or missing == "mj_checkVel"


@compiled_here
def test_hessian_words_are_counted_in_words() -> None:
    found = step_layout()
    assert isinstance(found, StepLayout)
    begin, end = found.contact["hessian_begin"], found.contact["hessian_end"]
    assert 0 < begin < end < found.contact["size"] // 8
