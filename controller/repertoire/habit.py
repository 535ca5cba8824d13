"""Habit and size of a species, as a person chooses them."""

from enum import StrEnum

SIZE = 0.32
"""Mean length of the animals over the recorded robot's (ours): the world is a model of 9 m."""


class Habit(StrEnum):
    """Goal of a body that neither flees nor avoids another one."""

    WANDER = "wander"
    """A place of its own."""
    SCHOOL = "school"
    """A place of all, in the direction of the neighbours, towards their middle."""
    FEED = "feed"
    """The nearest food."""
    PURSUE = "pursue"
    """The nearest body of a species that does not pursue."""
