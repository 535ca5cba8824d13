"""Drivers: from a vetted ``JointCommand`` to Protocol 2.0 packets, and back to a ``JointState``.

Commands go down (safety, chain, bus, byte port); a state comes back up. The controller may import
only `types`, `clock`, `link`, `errors` and `compiling`.
"""
