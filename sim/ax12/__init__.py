"""The AX-12A and its Protocol 1.0: an optional second kind of servo on the same wire.

``feetech`` builds on it, and ``serve`` offers it; no other package of ``sim`` imports it.
"""
