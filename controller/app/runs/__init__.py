"""One run, from its configuration to what it leaves behind, on metal or in the simulator.

``factory`` makes a ``PreparedRun`` of a configuration (one module a kind of motion), ``execute``
carries it out on a ``backend`` with a ``pose_provider``.
"""
