"""The loop: steering by the measured pose, absolute deadlines, ramps, alarms."""
