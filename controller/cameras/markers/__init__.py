"""Printed markers on the floor: found in a picture, and results from them."""
