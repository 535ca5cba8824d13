"""Drivers: from a vetted ``JointCommand`` to Protocol 2.0 packets, and back to a ``JointState``.

The controller may import only `types`, `clock`, `link`, `errors` and `compiling`.
"""
