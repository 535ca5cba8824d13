"""The body, its ground, water and obstacles in MuJoCo, as a ``sim.plant.Plant``.

Contacts are frictionless in MuJoCo; the snake's anisotropic friction is added here, compiled.
"""
