"""Damaged files of other programs, each read in a process with limits of memory and time."""
