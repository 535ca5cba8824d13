"""Recorded actions: record and look at them, run a plan of them, play them, fill a world."""
