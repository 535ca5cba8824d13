"""Actions recorded from the physics, and their use without it ([YT]).

A ``Segment`` is one settled cycle of an action in the body frame; a ``Repertoire`` has those of a
robot on a ground.
"""
