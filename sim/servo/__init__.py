"""The simulated DYNAMIXEL X servo: control tables, firmware, motor and protections.

``bank`` holds the control tables of all servos as one array (servos x bytes). ``firmware`` turns
registers into the drive of the motors (``sim.plant.ServoDrive``) as time passes. ``present_values``
writes the state of the shafts back into the registers.
"""
