"""Figures of studies: sweeps, trials, comparisons of runs, and walks."""
