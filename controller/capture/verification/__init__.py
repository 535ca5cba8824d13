"""Finished skeletons compared with the pixels of their own frames.

``frame_store`` keeps the cut-outs, ``profiles`` measures contrasts along and beyond a body,
``lines`` tests its form, and ``film_check`` rejects the frames that fail. ``remedies``
tries options that help if too many fail.
"""
