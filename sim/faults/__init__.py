"""Faults of a simulated line, played from a fault file with a seed."""
