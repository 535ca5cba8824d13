"""Entry point and lazy command table."""
