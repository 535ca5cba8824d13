"""Commands of learnt policies, one command per file."""
