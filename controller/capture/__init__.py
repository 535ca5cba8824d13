"""Recordings in: tracked midlines, keypoints and joint angles become one ``Track``.

``formats`` recognises a file by its content, ``track`` turns its points into tangent angles at 100
equal arc lengths, ``wave`` says which way the body wave runs, and ``generated`` makes the shipped
recordings from figures measured on real animals.
"""
