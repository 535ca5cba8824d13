"""Figures of a log: path error, tracking, timing, ground contact, displacement, effort.

``summary`` gathers the numbers of a run; ``comparison`` compares two runs row by row.
"""
