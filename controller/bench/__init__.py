"""Service of a bus: ``scan`` lists servos, ``servo_settings`` changes one, ``sniff`` taps the line.

``doctor`` examines whether a bus is fit for a run. Each of its checks (``adapter``,
``servo_checks``) makes findings from the readings; their order ensures that no fault hides the
next. Only ``servo_settings`` writes to a servo.
"""
