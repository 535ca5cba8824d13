"""Readers of recordings: every file format becomes one ``Track``.

``load`` is the entry: it accepts a shipped name (made by ``generated``) or a file, whose format
``formats`` recognises by its first bytes. ``arrays``, ``tables``, ``wcon`` and ``hdf5`` read
bodies; ``keypoints``, ``sleap`` and ``deeplabcut`` read the output of pose trackers.
"""
