"""Reference bytes of whole runs: ``python -m tests.reference``.

As in a command, numpy uses no loops for AVX-512, which have other sines (docs/architecture.md).
"""

from snakewalk.controller.cli.main import leave_out_avx512

leave_out_avx512()
