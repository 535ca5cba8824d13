"""Commands that import and export, one command per file."""
