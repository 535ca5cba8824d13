"""Commands, report and film: the only place that joins controller, bus and simulation."""
