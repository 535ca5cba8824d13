"""Simulated servos for other programs: a pseudo-terminal, a pytest fixture, a live table."""
