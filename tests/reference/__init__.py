"""Reference bytes of whole runs: ``python -m tests.reference``."""
