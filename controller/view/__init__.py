"""The page in a browser: a run while it lasts, or a log."""
