"""Fitness of a bus for a run, and what is to be done where it is not fit.

Each check is a function from what was read to findings; ``examine`` reads, in an order in which one
fault does not hide the next. Nothing is written to a servo.
"""
