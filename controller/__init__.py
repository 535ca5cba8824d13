"""Modules that decide the motion: from recordings to joint targets, and the loop that runs them.

``capture -> shape -> motion`` makes skeleton angles, ``terrain`` the path, ``runtime`` the loop;
only ``app`` joins them with the bus and the simulation.
"""
