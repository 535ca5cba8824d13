"""The work of the commands that take or make recordings: capture, track, and fish."""
