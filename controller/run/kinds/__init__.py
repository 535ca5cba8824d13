"""Kinds of runs: one prepared run per kind of motion."""
