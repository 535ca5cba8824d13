"""Faults of input, reported all at once.

``ConfigError`` carries one line per fault, each saying where, what, and what would be right.
The command line prints the lines and ends with exit code 2.
"""

from collections.abc import Sequence


class InputError(Exception):
    """What a user gave cannot be used; ``faults`` holds one line each."""

    def __init__(self, faults: str | Sequence[str]) -> None:
        self.faults: tuple[str, ...] = (faults,) if isinstance(faults, str) else tuple(faults)
        super().__init__("\n".join(self.faults))


class ConfigError(InputError):
    """A configuration file is missing, is not TOML, or breaks its schema."""
