"""The command line: ``main`` registers the commands, ``options`` is what they share."""
