"""Commands, report and film: the only place that joins controller, bus and simulation."""

import os

# The arrays are small: threads of BLAS wait for one another (a film took 129 s instead of 10).
# Read when numpy is first imported, so it has to stand here.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
