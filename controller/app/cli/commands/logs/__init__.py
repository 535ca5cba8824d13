"""Commands that read logs of runs: page and film, the same goals again, side by side, exports."""
