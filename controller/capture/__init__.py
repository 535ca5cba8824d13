"""Recordings in: tracked midlines, keypoints and joint angles become one ``Track``.

``load`` is the door: a shipped name, made by ``generated`` from figures of real animals, or a file,
which ``formats`` recognises by its content. ``track`` turns points into tangent angles at 100 equal
arc lengths, ``wave`` says which way the wave runs, ``slowing`` how much slower the servos must be.
"""
