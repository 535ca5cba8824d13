"""Mechanics on paper: ground contact, friction, loads and speed of a body, without a simulator."""
