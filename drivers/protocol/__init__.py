"""Protocol 2.0 as pure functions and one parser, used by the host and by the simulated servos."""
