"""Figures of captured and analysed tracks."""
