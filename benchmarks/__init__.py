"""What things cost: each module measures one of them against something known, in one process.

Times are CPU times of this process; only ratios of one run are compared, never machines. What comes
out of a run is the same on every machine, as of a command: numpy is told so before it is imported.
"""

from snakewalk.controller.cli.main import leave_out_avx512

leave_out_avx512()
