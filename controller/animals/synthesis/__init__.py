"""Motion of a snake synthesised over ground, without a robot ([PT] 2.5, 2.6)."""
