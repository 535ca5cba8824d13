"""One module for each figure; it draws a ``RunRecord`` as a matplotlib ``Figure``, or None.

None means that the log holds nothing to draw. Only the object interface of matplotlib is used: no
window, no global state.
"""
