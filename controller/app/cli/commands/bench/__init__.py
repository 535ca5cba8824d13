"""Commands at the bench: who is on a port, what is wrong with it, and off with the torque."""
