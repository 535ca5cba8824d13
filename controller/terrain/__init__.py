"""Terrain: risk of the ground, and safe paths over it."""
