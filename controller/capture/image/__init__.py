"""From a frame to the animal's midline ([PT] 2.2, 2.3).

``video`` gives frames and ``background`` the scene without the animal; ``silhouette`` is where they
differ, ``medial_axis`` its middle line from tip to tip, ``equipartition`` 100 equal chords on it.
``thin_body_fit`` takes the place of thinning for bodies as thin as their own blur.
"""
