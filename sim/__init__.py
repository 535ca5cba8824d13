"""Simulated hardware: servos on a simulated line that move a MuJoCo body.

Bytes come in from ``drivers`` at the byte port, move the simulated clock, and reach servos whose
shafts are the joints of the physics; nothing of ``controller`` is known here.
"""
