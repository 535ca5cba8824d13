"""Commands of one run, one command per file."""
