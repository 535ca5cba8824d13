"""What answers like metal: simulated servos on a simulated line, turning a MuJoCo body.

Bytes come in from ``drivers`` at the byte port, move the simulated clock, and reach servos whose
shafts are the joints of the physics; nothing of ``controller`` is known here.
"""
