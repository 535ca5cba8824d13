"""Units by the end of a key, for tables, pages, curves and columns of a log."""

UNITS = {
    "_rad_cycle": "rad per cycle",
    "_body_lengths_cycle": "body lengths per cycle",
    "_rad_per_body_length": "rad per body length",
    "_body_lengths_s": "body lengths/s",
    "_body_lengths": "body lengths",
    "_rad_s2": "rad/s²",
    "_m_s2": "m/s²",
    "_rad_s": "rad/s",
    "_m_s": "m/s",
    "_n_m": "N m",
    "_m2": "m²",
    "_rad": "rad",
    "_deg": "°",
    "_hz": "Hz",
    "_kg": "kg",
    "_ms": "ms",
    "_mm": "mm",
    "_ah": "A h",
    "_px": "px",
    "_a": "A",
    "_c": "°C",
    "_j": "J",
    "_m": "m",
    "_s": "s",
    "_v": "V",
    "_w": "W",
}
"""Units by the end of a key; the longest end comes first."""


def label_and_unit(key: str) -> tuple[str, str]:
    """Return the words of a key without its unit, and the unit as people write it."""
    end = end_of(key)
    return key.removesuffix(end).replace("_", " "), UNITS.get(end, "")


def end_of(key: str) -> str:
    """Return the end of a key that is a unit: ``_rad``; empty without one."""
    return next((end for end in UNITS if key.endswith(end)), "")
