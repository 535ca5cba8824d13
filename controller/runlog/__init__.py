"""The run's log: one MCAP file that opens in Foxglove.

``writer.RunLog`` writes rows during the run; ``reader.read_log`` returns the arrays of
``record.RunRecord``, also from a truncated file.
"""
