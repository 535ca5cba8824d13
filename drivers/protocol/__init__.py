"""Protocol 2.0: packets, parser, control tables and registers, for host and servo."""
