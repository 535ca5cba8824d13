"""Descriptions of robot, ground, motion and run.

Schemas (pydantic, unknown keys refused), one strict loader that reports every fault of a file at
once, the height-field type, and the shipped TOML files and recordings. Data flows out of here and
never back in: nothing of ours is imported.
"""
