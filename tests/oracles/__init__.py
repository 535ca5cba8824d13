"""Independent models and drawn views with known truth: what only tests and benchmarks use."""
