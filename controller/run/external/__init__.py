"""Parts outside the control loop: pose sources, served robots, the second body."""
