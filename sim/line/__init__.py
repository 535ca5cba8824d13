"""The simulated bus below the protocol: instruction bytes in, reply bytes out.

``wire`` carries packets and owns simulated time; ``sim_line`` puts servos of Protocol 2.0 on it.
``instruction_handler`` answers any packet, ``group_fast_path`` those of a control cycle.
"""
