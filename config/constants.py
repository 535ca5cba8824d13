"""Physical constants that several packages share."""

GRAVITY_M_S2 = 9.81
"""Value for simulated physics, forecasts and metrics; the standard 9.80665 is 0.03 % less."""
