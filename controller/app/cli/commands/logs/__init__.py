"""Commands that read logs of runs: page and film, the same goals again, runs side by side."""
