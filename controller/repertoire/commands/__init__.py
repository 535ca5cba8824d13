"""Commands of recorded actions, one command per file."""
