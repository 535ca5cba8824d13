"""Reference bytes of whole runs: ``python -m tests.reference``.

As in a command, numpy uses no loops for AVX-512, which have other sines (docs/architecture.md).
OpenBLAS uses its kernel for Haswell on every processor: that for AVX-512 changes the last bits of
goals, and no byte on the wire.
"""

import os

from snakewalk.controller.cli.main import leave_out_avx512

leave_out_avx512()
os.environ.setdefault("OPENBLAS_CORETYPE", "Haswell")
