"""Printed markers on the floor: detection, and results from them."""
