"""The command line: one command a file, their options, keys of an operator."""
