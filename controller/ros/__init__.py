"""A run in a ROS 2 graph: it is told there, stopped from there, and commanded from there."""
