"""Calibration of a chain: the joint of each servo, its direction, zero and range."""
