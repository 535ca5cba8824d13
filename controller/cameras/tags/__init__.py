"""Printed tags on a robot's links: a pose source with six degrees of freedom."""
