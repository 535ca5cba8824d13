"""Printed tags on the links of a robot: a pose source with six degrees of freedom."""
