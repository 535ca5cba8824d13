"""Gaits: pure maps from a phase to joint angles, one file each; ``registry`` names them all.

A gait knows no time, no bus and no ground. ``controller.motion.gait_motion`` gives it a frequency,
keeps it within the robot's limits and lets its parameters change while it runs.
"""
