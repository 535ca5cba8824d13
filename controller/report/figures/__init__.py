"""Figures of a run: a module for each draws a ``RunRecord`` as a matplotlib ``Figure``, or None.

None means that the log has nothing to draw. They use matplotlib's object interface only: no window,
no global state.
"""
