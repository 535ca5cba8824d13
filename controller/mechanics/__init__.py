"""Mechanics without a simulator: ground contact, friction, loads and speed of a body."""
