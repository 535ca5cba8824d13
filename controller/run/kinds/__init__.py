"""Kinds of runs: one module per kind of motion, each a prepared run."""
