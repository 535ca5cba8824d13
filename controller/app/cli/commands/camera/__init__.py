"""Commands of the camera above the robot: what to print, its lens, its markers, its check."""
