"""Small, blurred bodies fitted to the grey values of a whole film, with one body for all frames.

``crop`` is the stored part of a frame, ``ribbon`` the picture of a blurred body, ``film_body`` the
fit of the shared body and ``film_fit`` that of every frame. ``blur_estimate`` is the expected error
of a body without a fit.
"""
