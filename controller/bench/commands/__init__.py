"""Commands for servos on a bus, one command per file."""
