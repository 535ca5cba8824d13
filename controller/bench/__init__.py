"""Bench tools: list, examine, set up and calibrate the servos of a bus.

The order of ``doctor``'s checks ensures that no fault hides the next. Only ``servo_settings``
writes to a servo.
"""
