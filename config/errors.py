"""Faults of input, all reported at once.

``ConfigError`` has one line per fault: place, fault, remedy. The command line prints them and exits
with code 2. ``Assumptions`` has the answers to questions about a file.
"""

import math
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase


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

    A reader asks for a value with ``number``, and goes on with the likely one. ``check_used`` asks
    all open questions at once. ``*`` in a key stands for any text. ``lines`` lists the used values,
    for the output.
    """

    def __init__(self, given: Mapping[str, str] | None = None) -> None:
        self._values = dict(given or {})
        self._used: dict[str, str] = {}
        self._answered = set[str]()
        self._questions: dict[str, tuple[str, float]] = {}

    def given(self, key: str, low: float, high: float) -> float | None:
        """Value of a key as a number within limits, or None.

        Raises:
            InputError: the value is not a number, or beyond the limits.

        """
        patterns = [key, *(pattern for pattern in self._values if fnmatchcase(key, pattern))]
        name = next((pattern for pattern in patterns if pattern in self._values), None)
        if name is None:
            return None
        text = self._values[name]
        self._answered.add(name)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise InputError(f"--assume {key}={text}: must be a number from {low:g} to {high:g}")
        self._used[key] = text
        return value

    def number(self, key: str, low: float, high: float, missing: str, likely: float) -> float:
        """Value of a key that the file does not state; the likely one for now.

        Args:
            key: of the option.
            low: smallest value.
            high: largest value.
            missing: the missing value, with its place: ``link l4: states no mass``.
            likely: value to suggest.

        Raises:
            InputError: the value is unusable.

        """
        value = self.given(key, low, high)
        if value is None:
            self._questions[key] = missing, likely
            return likely
        return value

    def check_used(self, advice: str) -> None:
        """Ask all open questions at once; reject unused values.

        Raises:
            InputError: a value is missing, or unused; ``advice`` describes the command's keys.

        """
        asked = [
            f"{missing}; add --assume {key}={likely:.4g}"
            for key, (missing, likely) in self._questions.items()
        ]
        if len(asked) > 1:
            key, (_, likely) = next(iter(self._questions.items()))
            pattern = f"*.{key.rpartition('.')[2]}={likely:.4g}"
            asked.append(f"or give several values at once with a *: --assume '{pattern}'")
        if asked:
            raise InputError(asked)
        unused = [key for key in self._values if key not in self._answered]
        if unused:
            raise InputError(
                f"--assume {unused[0]}={self._values[unused[0]]}: this file does not need it; "
                f"{advice}"
            )

    @property
    def lines(self) -> list[str]:
        """One line per used value, for the output."""
        return [f"assumed by option: {key} = {value}" for key, value in self._used.items()]
