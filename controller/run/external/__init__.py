"""Parts outside of the control loop: pose sources, served robots, and the second body."""
