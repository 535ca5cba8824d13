"""Pictures and films of the simulated body, drawn without a screen."""
