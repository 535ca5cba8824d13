"""Units written as text, such as ``mm``, ``0.04*s`` or ``in/72``, as metres or seconds."""

import re

_PREFIX = {
    **{"": 1.0, "c": 1e-2, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "n": 1e-9},
    **{"k": 1e3, "K": 1e3, "M": 1e6, "G": 1e9},
}
_WORDS = {
    **{"centi": 1e-2, "milli": 1e-3, "micro": 1e-6, "nano": 1e-9, "": 1.0},
    **{"kilo": 1e3, "mega": 1e6, "giga": 1e9},
}
_SHORT = {"m": ("m", 1.0), "in": ("m", 0.0254), "s": ("s", 1.0), "sec": ("s", 1.0)} | {
    "min": ("s", 60.0), "h": ("s", 3600.0), "d": ("s", 86400.0)
}  # fmt: skip
_LONG = {"metre": ("m", 1.0), "meter": ("m", 1.0), "inch": ("m", 0.0254)} | {
    "micron": ("m", 1e-6), "second": ("s", 1.0), "minute": ("s", 60.0), "hour": ("s", 3600.0),
    "day": ("s", 86400.0),
}  # fmt: skip


def si_value(unit: str, dimension: str) -> float | None:
    """How many metres ("m") or seconds ("s") a unit is; None if it is of another kind.

    Prefixes and names as in the WCON format: short (``um``) or in full (``micrometres``), numbers
    as factors. Capitals matter.
    """
    value = 1.0
    kinds: list[str] = []
    parts = re.split(r"([*/])", unit.replace(" ", ""))
    for sign, word in zip(["*", *parts[1::2]], parts[::2], strict=True):
        kind, factor = _word(word)
        if factor == 0.0:
            return None
        value = value * factor if sign == "*" else value / factor
        kinds += [] if kind == "1" else [kind if sign == "*" else f"1/{kind}"]
    return value if kinds == [dimension] else None


def _word(word: str) -> tuple[str, float]:
    """Kind ("m", "s", "1" for a number, "?") and SI value of one factor of a unit."""
    try:
        return "1", float(word)
    except ValueError:
        singular = word.removesuffix("s")
    if word in _SHORT:
        return _SHORT[word]  # "min" is a minute, not a thousandth of an inch
    for base, (kind, factor) in _LONG.items():
        for name in (word, singular, "inch" if word == "inches" else word):
            if name.endswith(base) and name.removesuffix(base) in _WORDS:
                return kind, factor * _WORDS[name.removesuffix(base)]
    for base, (kind, factor) in _SHORT.items():
        if word.endswith(base) and word.removesuffix(base) in _PREFIX:
            return kind, factor * _PREFIX[word.removesuffix(base)]
    return "?", 1.0
