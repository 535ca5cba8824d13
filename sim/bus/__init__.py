"""Simulated DYNAMIXEL servos below the protocol: bytes in at ``line`` or ``pty``, bytes out.

``line`` carries packets and owns time; ``group`` (a cycle's packets, all servos at once) and
``service`` (anything else) answer them from the control tables in ``bank``; ``firmware`` turns
registers into the drive that the plant's motors take, and shafts back into registers.
"""
