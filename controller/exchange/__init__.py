"""Exports of a run's log: tables, a ROS 2 bag, and a scene for Foxglove.

Frames and joints have the names of ``robot export``.
"""
