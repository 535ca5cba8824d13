"""Closed-form gaits that need no recording."""
