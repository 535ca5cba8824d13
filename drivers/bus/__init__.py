"""Requests to servos and their replies, one result for each servo."""
