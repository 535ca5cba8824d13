"""Radians to bytes: from a vetted ``JointCommand`` down to Protocol 2.0 packets and back.

Commands go down (safety -> chain -> bus -> byte port), a ``JointState`` comes back. The vocabulary
(`types`, `clock`, `link`, `errors`; `compiling` for its loops) is what the controller may import;
the rest is plumbing.
"""
