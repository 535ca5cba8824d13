"""What things cost: each module measures one of them against something known, in one process.

Times are CPU times of this process; only ratios of one run are compared, never machines. What comes
out of a run is the same on every machine, as of a command: numpy is told so before it is imported.
"""

import os

from snakewalk.controller.app.cli.main import LEFT_OUT_OF_NUMPY

os.environ.setdefault("NPY_DISABLE_CPU_FEATURES", LEFT_OUT_OF_NUMPY)
