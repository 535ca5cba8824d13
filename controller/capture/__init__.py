"""Recordings in: films, tracked midlines, keypoints and joint angles become one ``Track``.

``load`` is the door: a shipped name, made by ``generated`` from figures of real animals, or a file,
which ``formats`` recognises by its content. ``track`` turns points into tangent angles at 100 equal
arc lengths, ``wave`` says which way the wave runs, ``slowing`` how much slower the servos must be.

Films: ``video`` gives frames, ``background`` and ``silhouette`` the body, ``medial_axis`` and
``equipartition`` its midline, ``identity`` which end is the head; ``capture`` joins them;
``refine`` fits small bodies to the grey values of the whole film. ``fish``
fits a deformable model instead. ``analysis`` measures a track, ``body_model`` gives it a skin.
"""
