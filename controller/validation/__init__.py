"""Published measurements, played in the simulator and compared."""
