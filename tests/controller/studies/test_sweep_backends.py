"""Which simulator a sweep uses: found as a plug-in, refused with a sentence where it cannot run."""

import importlib.util

import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.console.plugins import names, require
from snakewalk.controller.run.external.robot_batch import batch_fault
from snakewalk.controller.studies.sweep_backends import SweepOptions, WarpBackend
from snakewalk.controller.studies.sweep_measure import prepared_point
from snakewalk.controller.studies.sweep_points import Point
from tests.helpers.command import snakewalk


def test_both_backends_are_found_and_a_misspelt_one_is_refused() -> None:
    assert {"processes", "warp"} <= set(names("backend"))
    assert require("backend", "warp", "--backend").load() is WarpBackend
    with pytest.raises(InputError, match=r"--backend wrap: unknown; did you mean warp\?"):
        require("backend", "wrap", "--backend")


@pytest.mark.parametrize(
    ("backend", "dask", "fault"),
    [
        ("processes", None, "--backend processes:gpu: accepts no argument"),
        ("warp", "tcp://x:1", "--backend warp: does not run on a Dask cluster; omit --dask"),
    ],
)
def test_wrong_options_are_refused_before_a_point_runs(
    backend: str, dask: str | None, fault: str
) -> None:
    with pytest.raises(InputError) as refused:
        require("backend", backend, "--backend").load()(SweepOptions("gpu", 2, dask))
    assert refused.value.faults == (fault,)


@pytest.mark.parametrize(
    ("gait", "robot", "world", "fault"),
    [
        ("lateral-undulation", "yaw16", "flat", None),
        ("lateral-undulation", "yaw16", "random-10", "world random-10: is not a level, open floor"),
        ("lateral-undulation", "yaw16", "pegs", "world pegs: is not a level, open floor"),
        ("sidewinding", "alternating16-imu", "isotropic", "robot alternating16-imu: has an IMU"),
        ("rolling", "sts3215-12", "isotropic", "robot sts3215-12: has servos of Feetech"),
    ],
)
def test_runs_that_a_batch_cannot_do_say_why(
    gait: str, robot: str, world: str, fault: str | None
) -> None:
    run = prepared_point(Point(gait, robot, world, 0, 0, 4.0))
    assert batch_fault(run.run, run.robot, run.world) == fault


def test_without_the_extra_the_command_names_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    installed = importlib.util.find_spec
    monkeypatch.setattr(
        "snakewalk.config.extras.find_spec",
        lambda name: None if name in {"warp", "mujoco_warp"} else installed(name),
    )
    ran = snakewalk("gait", "sweep", "rolling", "--points", "1", "--backend", "warp")
    assert ran.returncode == 2
    fault = "--backend warp needs Warp and MuJoCo-Warp: pip install 'snakewalk[warp]'"
    assert ran.stderr.strip() == f"snakewalk: {fault}"
