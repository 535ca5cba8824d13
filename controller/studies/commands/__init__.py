"""Commands of studies, one command per file."""
