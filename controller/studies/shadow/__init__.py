"""A simulation of the robot with the same goals, and the differences between the two."""
