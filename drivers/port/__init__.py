"""Bytes out and bytes in on a line, with a clock."""
