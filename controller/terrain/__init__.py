"""Terrain: how risky the ground is, and safe paths over it."""
