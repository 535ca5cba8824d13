"""The run on paper, on ramps: up is slower than down, level is as without a ground."""

import json
from pathlib import Path

import numpy as np

from snakewalk.config.heightfield import HeightField
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.runtime.forecast import Forecast, forecast
from tests.helpers.command import snakewalk


def ahead(rise: float | None, limit_s: float = 30.0) -> Forecast:
    """Two metres along x on a plane that rises by ``rise`` per metre."""
    run = prepare_walk("flat-slalom", motion="serpenoid", waypoints_m=[(2.0, 0.0)])
    x = np.arange(-4.0, 4.5, 0.5)
    ground = None if rise is None else HeightField(np.tile(rise * x, (len(x), 1)), 0.5, -4.0, -4.0)
    return forecast(
        run.pilot(level=True), run.robot, run.world.friction, start_m=np.array(run.run.start_m),
        heading_rad=run.start_heading_rad, ground=ground, limit_s=limit_s,
    )  # fmt: skip


def test_level_ground_is_as_none_bit_for_bit() -> None:
    none, level = ahead(None), ahead(0.0)
    assert none.joint_rad.tobytes() == level.joint_rad.tobytes()
    assert none.centre_m.tobytes() == level.centre_m.tobytes()
    assert none.torque_n_m.tobytes() == level.torque_n_m.tobytes()
    assert level.slide is None


def test_up_takes_longer_than_level_and_level_than_down() -> None:
    up, level, down = ahead(0.06), ahead(0.0), ahead(-0.06)
    assert up.reached == level.reached == down.reached == 1
    assert up.duration_s > level.duration_s > down.duration_s
    assert up.slide is None


def test_a_slope_that_nothing_holds_on_carries_the_body_down_and_is_told() -> None:
    steep = ahead(0.9, limit_s=1.0)
    assert steep.slide is not None
    assert steep.slide.holding_rad < steep.slide.slope_rad
    np.testing.assert_allclose(steep.slide.slope_rad, np.arctan(0.9))
    assert steep.slide.lasted_s > 0.5
    assert steep.centre_m[-1, 0] < steep.centre_m[0, 0] - 0.3


def test_the_plan_says_that_its_ground_is_too_steep(tmp_path: Path) -> None:
    (tmp_path / "cliff.toml").write_text(
        'name = "cliff"\n[ground]\nkind = "elevation"\nrow = 276\ncolumn = 91\nrows = 50\n'
        "columns = 50\nspacing_m = 0.18\nvertical_scale = 0.01\n"
        "[planner]\nvariance_limit_m2 = 9.0\nslope_limit_rad = 1.4\n"
    )
    run = tmp_path / "run.toml"
    run.write_text(
        'name = "r"\nrobot = "alternating16"\nworld = "cliff.toml"\nmotion = "serpenoid"\n'
        "time_limit_s = 3.0\nstart_m = [0, 0]\nwaypoints_m = [[1, 0]]\n"
    )
    done = snakewalk("plan", str(run), "--json")
    assert done.returncode == 1, done.stderr  # 3 s are too short for the waypoint
    assert "0 of 1 waypoints are reached in 3 s" in str(json.loads(done.stdout)["warnings"])
    assert " deg of " in json.loads(done.stdout)["steeper_than_held"]
