"""The AX-12A and its Protocol 1.0: an optional second kind of servo on the same wire.

No other room of ``sim`` depends on it but ``serve``, which offers it by name.
"""
