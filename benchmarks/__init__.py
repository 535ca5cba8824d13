"""What things cost: each module measures one of them against something known, in one process.

Times are CPU times of this process; only ratios of one run are compared, never machines.
"""
