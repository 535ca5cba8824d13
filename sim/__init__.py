"""Simulated hardware: servos on a simulated line that move a MuJoCo body.

Bytes from ``drivers`` arrive at the byte port and move the simulated clock. They reach servos whose
shafts are the joints of the physics. This package does not import ``controller``.
"""
