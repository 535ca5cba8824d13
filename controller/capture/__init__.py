"""Recordings in: films, tracked midlines, keypoints and joint angles become one ``Track``.

``readers`` load recordings; ``track`` turns points into tangent angles at 100 equal arc lengths
(``resample``). For films, ``image`` finds a body in a frame, ``body_detector`` knows the scene, and
``capture`` goes through the film. ``outlier_frames`` marks unusual bodies. ``identity`` keeps head
and tail, ``small_body`` fits small bodies, ``scale`` gives metres. ``analysis`` measures a track:
its ``wave``, ``pulse_speed`` and ``undulation``; ``slowing`` adapts it to the servos. ``mesh``
gives the body a skin. ``fish`` matches a deformable model to a film, and composes new motion of its
parts.
"""
