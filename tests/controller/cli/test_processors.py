"""A run gives the same log on processors of several kinds.

OpenBLAS and numpy choose their loops by the processor; told to, they take those of another one.
"""

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

RUN = """
import sys
from pathlib import Path
from snakewalk.controller.run.execute import execute
from snakewalk.controller.run.factory import prepare_walk
near = prepare_walk("jacksboro-traverse", waypoints_m=((0.6, 0.2),), time_limit_s=1.0)
execute(near, Path(sys.argv[1]))
"""
COMMAND = """
import sys
from snakewalk.controller.cli.main import main
assert "numpy" not in sys.modules
sys.argv = ["snakewalk", "list", "--json"]
try:
    main()
except SystemExit as end:
    assert not end.code
from numpy._core._multiarray_umath import __cpu_features__
assert not [each for each, has in __cpu_features__.items() if has and "AVX512" in each]
"""
_AVX512 = "X86_V4 AVX512_ICL AVX512_SPR"
PROCESSORS = {"Haswell": _AVX512, "Sandybridge": _AVX512, "Prescott": f"X86_V3 {_AVX512}"}
"""Kernels of OpenBLAS with and without fused products, and what numpy must do without.

numpy's loops for AVX-512 have sines of their own (docs/architecture.md): left out on all.
"""


@pytest.mark.skipif(
    platform.machine() not in {"x86_64", "AMD64"}, reason="the kernels are those of x86-64"
)
def test_a_run_over_hills_leaves_the_same_bytes_whatever_kernel_multiplies(tmp_path: Path) -> None:
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", RUN, str(tmp_path / kernel)],
            env=os.environ | {"OPENBLAS_CORETYPE": kernel, "NPY_DISABLE_CPU_FEATURES": without},
        )
        for kernel, without in PROCESSORS.items()
    ]
    assert [run.wait() for run in runs] == [0] * len(runs)
    logs = [(tmp_path / kernel / "log.mcap").read_bytes() for kernel in PROCESSORS]
    assert len(logs[0]) > 50_000
    assert logs[1] == logs[0]
    assert logs[2] == logs[0]


@pytest.mark.skipif(
    platform.machine() not in {"x86_64", "AMD64"}, reason="other processors have no AVX-512"
)
def test_a_command_has_numpy_do_without_its_other_sines() -> None:
    """They hang on the processor: main is in time only as long as it does not import numpy."""
    env = {name: value for name, value in os.environ.items() if "CPU_FEATURES" not in name}
    done = subprocess.run(
        [sys.executable, "-c", COMMAND], env=env, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
