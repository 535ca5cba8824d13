"""Bytes of a bus in words: each packet decoded by the control tables of its servos."""
