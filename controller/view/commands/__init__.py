"""The command that shows a log in the browser."""
