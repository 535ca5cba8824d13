"""Bench of films of real animals: what ``snakewalk capture`` makes of them, beside the truth."""
