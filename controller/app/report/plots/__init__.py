"""Pictures of the commands that take ``--picture``, and of capture: one module a subject."""
