"""A run in a ROS 2 graph: it is published there, stopped from there, and commanded from there."""
