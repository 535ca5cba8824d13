"""The run's log: everything the loop knows, as one MCAP file that opens in Foxglove.

Rows go in through ``writer.RunLog`` while the robot moves, and come back as the arrays of
``record.RunRecord`` through ``reader.read_log``, also from a file that a kill has cut short.
"""
