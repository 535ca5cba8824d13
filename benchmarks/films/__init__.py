"""Bench of films of real animals: what ``snakewalk animal capture`` makes of them, and truth."""
