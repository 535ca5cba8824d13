"""Figures of animals' bodies and motions."""
