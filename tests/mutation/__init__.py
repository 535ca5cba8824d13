"""Mutation of the code that safety hangs on: each small change must make a test fail."""
