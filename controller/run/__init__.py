"""One run from configuration to log; joins controller, drivers and simulation."""
