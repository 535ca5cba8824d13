"""Commands of animals' bodies, one command per file."""
