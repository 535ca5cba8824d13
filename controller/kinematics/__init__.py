"""Kinematics: poses of links, frames of the body, and joint angles from its shape."""
