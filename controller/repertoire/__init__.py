"""Actions recorded from the physics, and what is done with them without it ([YT]).

A ``Segment`` is one settled cycle of an action in the body frame; a ``Repertoire`` holds those of a
robot on a ground. From there data goes to ``replay`` (one body), ``crowd`` (thousands), ``search``
(sequences through waypoints) and ``motion`` (joint goals for the bus). Recording needs the physics
and is in ``controller/run``.
"""
