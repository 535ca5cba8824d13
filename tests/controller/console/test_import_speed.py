"""What a start imports, and without garbage collections."""

import gc
import subprocess
import sys

import pytest

from snakewalk.controller.console.imports import without_collections
from tests.helpers.frozen import frozen_objects


@pytest.mark.costs("starts an interpreter")
def test_a_gait_on_a_port_imports_no_simulator_and_no_walk() -> None:
    """They needed 0.6 of 1.6 s of processor time until torque."""
    program = (
        "import sys; import snakewalk.controller.run.commands.gait_run; "
        "print(*(name for name in sys.modules if name.startswith(('snakewalk', 'scipy'))))"
    )
    found = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout.split()
    assert "snakewalk.controller.run.run_robot" in found
    for unneeded in (
        "snakewalk.sim.line.sim_line",
        "snakewalk.sim.feetech.line",
        "snakewalk.controller.walk.pilot",
        "snakewalk.controller.mechanics.rollout_kernel",
        "snakewalk.controller.terrain.planner",
        "scipy.ndimage",
    ):
        assert unneeded not in found


def test_collections_are_paused_and_go_on() -> None:
    enabled, frozen = gc.isenabled(), frozen_objects()
    gc.enable()
    try:
        with without_collections():
            assert not gc.isenabled()
            with without_collections():
                pass
            assert not gc.isenabled()
        assert gc.isenabled()
        with pytest.raises(ImportError), without_collections():
            raise ImportError
        assert gc.isenabled()
        assert (frozen_objects() > 0) == (frozen > 0)
    finally:
        if not enabled:
            gc.disable()
