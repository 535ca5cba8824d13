"""A fish from video, [TH]: a deformable model matched to every frame, its motion cut and rejoined.

``model`` bends and projects the fish, ``raster`` draws it as the camera would see it, and
``matching`` scores a posture by area and edges. ``pattern_search`` searches, ``first_frame`` and
``calibrate`` start, ``tracking`` goes from frame to frame, ``side_view`` adds height and pitch.
``postures`` keeps the result. ``segments`` cuts it at basic postures, ``piece_graph`` says what may
follow what, ``synthesis`` strings pieces together and writes a motion that a run can play.
``rendered_fish`` and ``swimmer`` render films of a fish whose every angle is known; ``accuracy``
compares postures with known ones.
"""
