"""Gaits measured on the physics over many parameters, and the best of them looked for.

``points`` and ``plan`` say what to try, ``measure`` tries one point, ``pool`` tries many at once,
``table`` keeps every finished point, ``digest`` and ``picture`` sum it up, ``tune`` searches.
"""
