"""Servos named on a command line: ``1-16``, ``1,2,5-8:XL330-M288``."""

from dataclasses import dataclass

from config.errors import InputError

DEFAULT_MODEL = "XM430-W350"
_LAST = 252


@dataclass(frozen=True, slots=True)
class ChainSpec:
    """IDs along the chain, and the model of all."""

    ids: tuple[int, ...]
    model: str = DEFAULT_MODEL


def parse_chain(text: str) -> ChainSpec:
    """Read ``IDS[:MODEL]``.

    Raises:
        InputError: no numbers, a range that runs backwards, or an ID out of 0 to 252.

    """
    numbers, _, model = text.partition(":")
    ids: list[int] = []
    for piece in numbers.split(","):
        first, dash, last = piece.strip().partition("-")
        try:
            low = int(first)
            high = int(last) if dash else low
        except ValueError:
            raise InputError(
                f"--servos {text}: {piece!r} is no ID; write 1-16 or 1,2,5-8:XL330-M288"
            ) from None
        if high < low:
            raise InputError(f"--servos {text}: {piece} runs backwards")
        wrong = [each for each in (low, high) if not 0 <= each <= _LAST]
        if wrong:
            raise InputError(f"--servos {text}: ID {wrong[0]}: a servo has 0 to {_LAST}")
        ids += range(low, high + 1)
    return ChainSpec(tuple(ids), (model or DEFAULT_MODEL).upper().replace("_", "-"))
