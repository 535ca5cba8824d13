"""Commands of the overhead camera, one command per file."""
