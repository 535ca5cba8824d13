"""Faults of input, all reported at once.

``ConfigError`` has one line per fault: place, fault, remedy. The command line prints them and exits
with code 2. ``Assumptions`` has the answers to questions about a file.
"""

import math
from collections.abc import Iterable, Sequence


class InputError(Exception):
    """Unusable user input; ``faults`` has one line each."""

    def __init__(self, faults: str | Sequence[str]) -> None:
        self.faults: tuple[str, ...] = (faults,) if isinstance(faults, str) else tuple(faults)
        super().__init__("\n".join(self.faults))


def first_line(error: Exception) -> str:
    """Return the first line of an error's text, or its type if it has none."""
    return (str(error).splitlines() or [type(error).__name__])[0]


class ConfigError(InputError):
    """A configuration file is missing, is not TOML, or breaks its schema."""


class Assumptions:
    """Values of a user for facts that a foreign file does not state: ``--assume KEY=VALUE``.

    A reader asks for a value with ``number``. If it is missing, the question is an ``InputError``
    with the option and the likely value. ``lines`` lists the used values, for the output.
    """

    def __init__(self, given: Iterable[str] = ()) -> None:
        """Read ``KEY=VALUE`` words.

        Raises:
            InputError: a word has another form, or a key is repeated.

        """
        self._values: dict[str, str] = {}
        self._used: dict[str, str] = {}
        for word in given:
            key, sign, value = word.partition("=")
            if not (key.strip() and sign and value.strip()):
                raise InputError(f"--assume {word}: must be KEY=VALUE")
            if key.strip() in self._values:
                raise InputError(f"--assume {word}: {key.strip()} is given twice")
            self._values[key.strip()] = value.strip()

    def given(self, key: str, low: float, high: float) -> float | None:
        """Value of a key as a number within limits, or None.

        Raises:
            InputError: the value is not a number, or beyond the limits.

        """
        text = self._values.get(key)
        if text is None:
            return None
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise InputError(f"--assume {key}={text}: must be a number from {low:g} to {high:g}")
        self._used[key] = text
        return value

    def number(
        self, key: str, low: float, high: float, missing: str, likely: float | None = None
    ) -> float:
        """Value of a key that the file does not state.

        Args:
            key: of the option.
            low: smallest value.
            high: largest value.
            missing: the missing value, with its place: ``link l4: states no mass``.
            likely: value to suggest.

        Raises:
            InputError: the value is missing (the question), or unusable.

        """
        value = self.given(key, low, high)
        if value is None:
            shown = "VALUE" if likely is None else f"{likely:.4g}"
            raise InputError(f"{missing}; add --assume {key}={shown}")
        return value

    def check_used(self, advice: str) -> None:
        """Reject unused values.

        Raises:
            InputError: a value is unused; ``advice`` describes the command's keys.

        """
        unused = [key for key in self._values if key not in self._used]
        if unused:
            raise InputError(
                f"--assume {unused[0]}={self._values[unused[0]]}: this file does not need it; "
                f"{advice}"
            )

    @property
    def lines(self) -> list[str]:
        """One line per used value, for the output."""
        return [f"assumed by option: {key} = {value}" for key, value in self._used.items()]
