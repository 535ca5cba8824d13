"""Commands about a user's own files: ``init`` writes the first ones, ``schema`` is for editors.

``terrain`` makes worlds of files and pictures of real ground.
"""
