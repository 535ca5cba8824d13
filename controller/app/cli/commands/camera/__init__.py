"""Commands of the camera above the robot: what to print, and its lens."""
