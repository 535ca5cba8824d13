"""A simulated body that differs from its files in what the run says."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.friction_law import LAWS
from snakewalk.controller.run.deviation import Deviation
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot


def prepared(**told: float) -> GaitRun:
    keys: dict[str, Any] = {f"run.deviation.{name}": value for name, value in told.items()}
    keys["run.physics_step_s"] = 0.005
    return prepare_gait("lateral-undulation", robot="yaw16", seconds=3.0, keys=keys)


def current_a(folder: Path, **told: float) -> float:
    """Root mean square over a cycle and more."""
    record = run_robot(RunRequest(prepared(**told), folder, stoppable=False)).record
    assert record.header.run.deviation.mass == told.get("mass", 1.0)  # so it can be replayed
    cycle = record.cycle
    return float(np.sqrt((cycle.current_a[cycle.time_s > cycle.time_s[0] + 1.5] ** 2).mean()))


@pytest.mark.slow
def test_friction_of_a_heavier_body_takes_current_in_proportion(tmp_path: Path) -> None:
    """Coulomb friction is all that counts; a weaker servo needs as much more current."""
    nominal = current_a(tmp_path / "nominal")
    heavy = current_a(tmp_path / "heavy", mass=1.5)
    rough = current_a(tmp_path / "rough", friction_along=1.5, friction_across=1.5)
    weak = current_a(tmp_path / "weak", mass=1.5, torque=1.5)
    np.testing.assert_allclose([heavy / rough, heavy / nominal], [1.0, 1.5], rtol=0.12)
    np.testing.assert_allclose(weak / nominal, 1.0, rtol=0.12)


def test_a_seed_draws_the_errors_of_a_robot_and_its_ground() -> None:
    gait = prepared(drawn=True)

    def drawn(seed: int) -> Deviation:
        return Deviation.of_run(gait.run.model_copy(update={"seed": seed}), gait.robot)

    some = [drawn(seed) for seed in range(30)]
    assert {each.law for each in some} == set(LAWS)
    assert {each.along for each in some} == {0.8, 1.25}
    again = drawn(3)
    assert (again.law, again.across) == (some[3].law, some[3].across)
    for name in ("load_kg", "torque", "slip_rad"):
        np.testing.assert_array_equal(getattr(again, name), getattr(some[3], name))
        assert np.asarray(getattr(again, name)).any()
    friction = some[3].world(gait.world).friction
    assert friction.law == some[3].law
    assert gait.world.friction.law == "ellipse"  # what the planner has


def test_a_robot_on_a_port_is_as_it_is(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="deviation: changes a simulated robot only"):
        run_robot(RunRequest(prepared(mass=1.5), tmp_path / "run", port="/dev/nosuch"))
    assert not (tmp_path / "run").exists()
