"""Numbers as results state them: rounded, and None where they are not finite."""

import math


def rounded(value: float | None, digits: int) -> float | None:
    """Return a number with this many decimals; None if it is unknown or not finite."""
    return None if value is None or not math.isfinite(value) else round(float(value), digits)


def significant(value: float | None, digits: int) -> float | None:
    """Return a number with this many significant digits; None if it is unknown or not finite."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.{digits}g}")
