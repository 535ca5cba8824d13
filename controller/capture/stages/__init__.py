"""Stages of a capture after the detector, and their order."""
