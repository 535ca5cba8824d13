"""The fault campaign: every kind of fault and every pair, from fixed seeds."""
