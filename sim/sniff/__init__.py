"""Decoders of bus packets into text, by the control tables of the servos."""
