"""The commands, one a file: options in, one call into the rest, a table or JSON out.

Heavy imports stand inside the functions, so that ``--help`` is quick and a robot's small computer
needs no simulator for the commands that use none.
"""
