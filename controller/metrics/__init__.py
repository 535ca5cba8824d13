"""Metrics of a log: path error, tracking, timing, ground contact, displacement, effort."""
