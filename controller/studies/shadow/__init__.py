"""The simulator beside the metal on the same goals, and what differs between the two."""
