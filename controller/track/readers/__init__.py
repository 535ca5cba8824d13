"""Readers of recordings: every file format becomes one ``Track``.

``load`` is the entry for shipped names (``generated``) and files, whose format ``formats``
recognises. ``arrays``, ``tables``, ``wcon`` and ``hdf5`` read bodies; ``keypoints``, ``sleap`` and
``deeplabcut`` read the output of pose trackers.
"""
