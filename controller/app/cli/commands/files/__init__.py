"""Commands about a user's own files: ``init`` writes the first ones, ``schema`` is for editors."""
