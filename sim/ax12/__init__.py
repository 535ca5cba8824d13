"""The AX-12A and its Protocol 1.0: an optional second kind of servo on the same wire.

The only other package of ``sim`` that imports it is ``serve``, which offers it by name.
"""
