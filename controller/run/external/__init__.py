"""Robots and poses outside of the program: external pose sources, and robots that are served."""
