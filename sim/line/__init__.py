"""The simulated bus below the protocol: the bytes of instructions in, the bytes of replies out.

``wire`` is a byte port that carries packets and owns simulated time; ``sim_line`` puts servos of
Protocol 2.0 on it. ``instruction_handler`` answers any packet servo by servo, ``group_fast_path``
the packets of a control cycle for all servos at once.
"""
