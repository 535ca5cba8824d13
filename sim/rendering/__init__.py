"""Pictures and films of the simulated body, drawn without a screen; no part of the physics."""
