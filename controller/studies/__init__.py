"""Studies: many runs measured, tuned, replayed and compared, on one pool of processes."""
