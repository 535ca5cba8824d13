"""Schemas of robot, ground, motion and run, their loader, and the shipped files.

The schemas (pydantic) reject unknown keys, and the loader reports every fault of a file at once.
The package also has the height-field type and the recordings. It imports no other package of
snakewalk.
"""
