"""Units in the files of other programs: their sizes and spellings.

No other module has factors of such units, so that each of them means one thing everywhere.
"""

import math
import re

DEGREE = "deg"
LENGTHS_M = {
    "m": 1.0,
    "cm": 0.01,
    "mm": 0.001,
    "km": 1000.0,
    "ft": 0.3048,
    "us-ft": 1200.0 / 3937.0,
}
"""Metres per unit of length, by the names that options accept."""
ANGLES_RAD = {"rad": 1.0, DEGREE: math.pi / 180.0}
TIMES_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_FEET = {
    "ft": ("ft", "foot", "feet", "international foot", "international feet", "foot international"),
    "us-ft": (
        "us-ft",
        "us survey foot",
        "us survey feet",
        "foot us",
        "ftus",
        "us foot",
        "sft",
        "foot us survey",
        "survey foot",
        "u s survey foot",
        "us survey ft",
        "usft",
    ),
}
"""Spellings of feet."""


def named_unit(words: str) -> str | None:
    """Unit of length as spelled in files: a name or metres, as for ``unit_m``; None if unknown."""
    plain = re.sub(r"[^a-z0-9-]+", " ", words.lower()).strip()
    for name, spellings in _FEET.items():
        if plain in spellings:
            return name
    factor_m = si_value(words.lower().strip(" []()"), "m")
    return None if factor_m is None else unit_name(factor_m)


def unit_name(factor_m: float) -> str:
    """Name of a unit by its length in metres, or that length as a number."""
    for name, length_m in LENGTHS_M.items():
        if math.isclose(length_m, factor_m, rel_tol=1e-8):
            return name
    return repr(float(factor_m))


def unit_m(unit: str) -> float:
    """Metres per unit of length, by name or as a number."""
    return LENGTHS_M[unit] if unit in LENGTHS_M else float(unit)


_PREFIX = {
    **{"": 1.0, "c": 1e-2, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "n": 1e-9},
    **{"k": 1e3, "K": 1e3, "M": 1e6, "G": 1e9},
}
_PREFIX_WORDS = {
    **{"centi": 1e-2, "milli": 1e-3, "micro": 1e-6, "nano": 1e-9, "": 1.0},
    **{"kilo": 1e3, "mega": 1e6, "giga": 1e9},
}
_SHORT_UNITS = {"m": ("m", 1.0), "in": ("m", 0.0254), "s": ("s", 1.0), "sec": ("s", 1.0)} | {
    "min": ("s", 60.0),
    "h": ("s", 3600.0),
    "d": ("s", 86400.0),
}
_LONG_UNITS = {"metre": ("m", 1.0), "meter": ("m", 1.0), "inch": ("m", 0.0254)} | {
    "micron": ("m", 1e-6),
    "second": ("s", 1.0),
    "minute": ("s", 60.0),
    "hour": ("s", 3600.0),
    "day": ("s", 86400.0),
}


def si_value(unit: str, dimension: str) -> float | None:
    """Factor from a unit to metres ("m") or seconds ("s"); None for another dimension.

    Accepts the WCON prefixes and names, short (``um``) or in full (``micrometres``), and numbers as
    factors. Case matters.
    """
    value = 1.0
    kinds: list[str] = []
    parts = re.split(r"([*/])", unit.replace(" ", ""))
    for sign, word in zip(["*", *parts[1::2]], parts[::2], strict=True):
        kind, factor = _unit_factor(word)
        if factor == 0.0:
            return None
        value = value * factor if sign == "*" else value / factor
        kinds += [] if kind == "1" else [kind if sign == "*" else f"1/{kind}"]
    return value if kinds == [dimension] else None


def _unit_factor(word: str) -> tuple[str, float]:
    """Kind ("m", "s", "1" for a number, "?") and SI value of a factor of a unit."""
    try:
        return "1", float(word)
    except ValueError:
        singular = word.removesuffix("s")
    if word in _SHORT_UNITS:
        return _SHORT_UNITS[word]  # "min" is a minute, not a milli-inch
    for base, (kind, factor) in _LONG_UNITS.items():
        for name in (word, singular, "inch" if word == "inches" else word):
            if name.endswith(base) and name.removesuffix(base) in _PREFIX_WORDS:
                return kind, factor * _PREFIX_WORDS[name.removesuffix(base)]
    for base, (kind, factor) in _SHORT_UNITS.items():
        if word.endswith(base) and word.removesuffix(base) in _PREFIX:
            return kind, factor * _PREFIX[word.removesuffix(base)]
    return "?", 1.0
