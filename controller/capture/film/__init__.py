"""Film of a capture: its options, its facts and its scale."""
