"""Commands that make and analyse tracks, one command per file."""
