"""Gaits: pure maps from a phase to joint angles, one file each; ``registry`` lists them.

``controller.motion.gait_motion`` adds frequency, limits and changes of parameters.
"""
