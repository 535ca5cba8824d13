"""A run gives the same log on processors of several kinds.

OpenBLAS and numpy choose their loops by the processor; told to, they take those of another one.
"""

import json
import os
import platform
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

try:
    from numpy._core import _multiarray_umath as multiarray
except ImportError:  # numpy 1
    from numpy.core import _multiarray_umath as multiarray

RUN = """
import sys
from pathlib import Path
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.run.factory import prepare_walk
near = prepare_walk("jacksboro-traverse", waypoints_m=((0.6, 0.2),), time_limit_s=1.0)
run_robot(RunRequest(near, Path(sys.argv[1])))
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
"""
PROBE = """
import hashlib, json, os
import numpy as np
try:
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
except ImportError:  # numpy 1
    from numpy.core._multiarray_umath import __cpu_dispatch__, __cpu_features__
angles = np.random.default_rng(0).uniform(-20.0, 20.0, 30_001)
values = [
    function(angles.astype(kind)[::step]).tobytes()
    for function in (np.sin, np.cos, np.exp) for kind in ("f8", "f4") for step in (1, 3)
]
in_force = [name for name in __cpu_dispatch__ if __cpu_features__[name]]
try:
    from numpy.lib.introspect import opt_func_info
except ImportError:  # numpy 1
    loops = {}
else:
    loops = opt_func_info("^(sin|cos|exp)$", "^float(32|64)$")
in_force += [kind["current"] for loop in loops.values() for kind in loop.values()]
told = os.environ.get("NPY_DISABLE_CPU_FEATURES", "")
print(json.dumps([hashlib.sha256(b"".join(values)).hexdigest(), in_force, told.split()]))
"""
_FOR_AVX512 = re.compile("AVX512|AVX10|X86_V[4-9]")
"""Names of numpy's loops that need AVX-512, in all versions."""
KERNELS = {"Prescott": (), "Sandybridge": ("AVX",), "Haswell": ("AVX2", "FMA3")}
"""Kernels of OpenBLAS with and without fused products, and what a processor needs for them."""


def avx512_loops() -> str:
    """Names of the loops for AVX-512 that the installed numpy has; the processor may lack it."""
    return " ".join(name for name in multiarray.__cpu_dispatch__ if _FOR_AVX512.search(name))


@pytest.mark.nightly("four runs with other kernels of the processor: 14 s of CPU")
@pytest.mark.skipif(
    platform.machine() not in {"x86_64", "AMD64"}, reason="the kernels are those of x86-64"
)
def test_a_run_over_hills_leaves_the_same_bytes_whatever_kernel_multiplies(tmp_path: Path) -> None:
    has = multiarray.__cpu_features__
    kernels = [kernel for kernel, needs in KERNELS.items() if all(has[name] for name in needs)]
    if len(kernels) == 1:
        pytest.skip("this processor runs one kernel only")
    # numpy's loops for AVX-512 have sines of their own (docs/architecture.md): left out on all
    without = {kernel: avx512_loops() for kernel in kernels} | {
        "Prescott": f"X86_V3 {avx512_loops()}"
    }
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", RUN, str(tmp_path / kernel)],
            env=os.environ
            | {"OPENBLAS_CORETYPE": kernel, "NPY_DISABLE_CPU_FEATURES": without[kernel]},
        )
        for kernel in kernels
    ]
    assert [run.wait() for run in runs] == [0] * len(runs)
    logs = [(tmp_path / kernel / "log.mcap").read_bytes() for kernel in kernels]
    assert len(logs[0]) > 50_000
    assert all(log == logs[0] for log in logs)


@pytest.mark.slow
@pytest.mark.skipif(
    platform.machine() not in {"x86_64", "AMD64"}, reason="other processors have no AVX-512"
)
def test_a_command_computes_the_same_sines_with_and_without_avx512() -> None:
    """Its numpy uses no loop for AVX-512; main acts in time as long as it does not import numpy."""
    env = {name: value for name, value in os.environ.items() if "CPU_FEATURES" not in name}
    told = env | {"NPY_DISABLE_CPU_FEATURES": avx512_loops()}
    bits, in_force, left_out = probed(COMMAND + PROBE, env)
    assert bits == probed(PROBE, told)[0]
    assert not [name for name in in_force if _FOR_AVX512.search(name)]
    # the processor of this test may have no AVX-512: the command names every such loop all the same
    assert set(avx512_loops().split()) <= set(left_out)


def probed(program: str, env: dict[str, str]) -> list[Any]:
    """Bits of sines, cosines and exponentials, loops in force, and loops that are left out."""
    done = subprocess.run(
        [sys.executable, "-c", program], env=env, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    found: list[Any] = json.loads(done.stdout.splitlines()[-1])
    return found
