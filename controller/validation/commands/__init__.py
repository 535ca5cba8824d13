"""Command that compares the simulator with published measurements."""
