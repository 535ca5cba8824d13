"""Pose sources: where the head is, with time and uncertainty."""
