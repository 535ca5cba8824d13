"""The simulated DYNAMIXEL X servo: control tables, firmware, motor and protections.

``bank`` holds the control tables of all servos as one array (servos x bytes). ``firmware`` turns
registers into the motors' drive (``sim.plant.ServoDrive``). ``present_values`` writes the shafts'
state into the registers.
"""
