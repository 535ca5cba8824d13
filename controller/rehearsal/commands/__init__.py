"""Commands that judge and rehearse runs, one command per file."""
