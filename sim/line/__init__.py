"""Simulated DYNAMIXEL servos below the protocol: bytes in at ``line`` or ``pty``, bytes out.

``wire`` carries packets and owns time; on it ``line`` has servos of Protocol 2.0 and ``ax12_line``
those of 1.0. ``group`` (a cycle's packets, all servos at once) and ``service`` (anything else)
answer from the control tables in ``bank``; ``firmware`` turns registers into the drive that the
plant's motors take, with ``loops``, ``profile``, ``watchdog`` and ``protection``, and ``readout``
shafts back into registers. ``fault_player`` spoils it by a file, on any line that is a
``fault_target``; ``decode`` puts an exchange in words.
"""
