"""sniff."""
