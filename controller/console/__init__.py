"""Shared by commands: options, progress bars, messages, tables, result files, process pool."""
