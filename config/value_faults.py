"""Faults of a value, of a file or of the command line, in words."""

import math
import re
from typing import Any

_NOT_IN_NAMES = r"/\\\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""Characters that no name contains: those of folders and of ``plain_text``."""
NAME_PATTERN = f"^[^.{_NOT_IN_NAMES}][^{_NOT_IN_NAMES}]*$"
STOP_OUTPUT_PATTERN = r"^(-?(rts|dtr):.+|command:/.+)$"
MARK_PATTERN = "^(set|fixed|usual|kept|ignored: .+)$"
_USUAL_UNITS = {"rad": ("degrees", math.pi / 180.0), "m": ("mm", 1e-3)}
"""Units of keys: a unit that people often use instead, and its size."""
PATTERNS_IN_WORDS = {
    MARK_PATTERN: "must be set, fixed, usual, kept, or ignored: REASON",
    NAME_PATTERN: "holds '/', a control character or a leading dot",
    STOP_OUTPUT_PATTERN: "must be rts:PORT, -rts:PORT, dtr:PORT, -dtr:PORT or "
    "command:/PROGRAM ARGUMENT",
}
"""Messages for texts that do not match; those of simple patterns are derived from the pattern."""


def in_words(fault: dict[str, Any], unknown_key: str = "") -> str:
    """Return what is wrong with a value, from an entry of pydantic's ``errors``.

    Args:
        fault: the entry.
        unknown_key: hint on a key that the schema does not have.

    """
    context = fault.get("ctx", {})
    if "than" in str(fault["type"]) and not _is_finite(fault.get("input")):
        return "must be a finite number"
    bounds = {key: context[key] for key in ("gt", "ge", "lt", "le") if key in context}
    tag = context.get("tag")
    expected_tags = context.get("expected_tags")
    said = {
        "missing": "is required",
        "tuple_type": "must be a list: [ ... ]",
        "model_type": "must be a table",
        "model_attributes_type": "must be a table",
        "dict_type": "must be a table",
        "string_type": "must be text",
        "int_type": "must be a whole number",
        "int_parsing": "must be a whole number",
        "int_parsing_size": "must be a whole number of at most 4300 digits",
        "int_from_float": "must be a whole number",
        "float_type": "must be a number",
        "float_parsing": "must be a number",
        "bool_type": "must be true or false",
        "bool_parsing": "must be true or false",
        "finite_number": "must be a finite number",
        "union_tag_invalid": f"kind {tag!r} is unknown; use one of {expected_tags}",
        "union_tag_not_found": "needs a key kind",
        "literal_error": f"must be {context.get('expected')}",
        "enum": f"must be {context.get('expected')}",
        "greater_than": f"must be over {bounds.get('gt', 0):g}",
        "greater_than_equal": f"must be at least {bounds.get('ge', 0):g}",
        "less_than": f"must be under {bounds.get('lt', 0):g}",
        "less_than_equal": f"must be at most {bounds.get('le', 0):g}",
        "too_long": f"must have at most {context.get('max_length')} values",
        "too_short": f"must have at least {context.get('min_length')} values",
        "string_too_long": f"must have at most {context.get('max_length')} characters",
        "string_too_short": "must not be empty",
        "extra_forbidden": f"unknown key{unknown_key}",
        "string_pattern_mismatch": _pattern_in_words(str(context.get("pattern"))),
    }
    return said.get(str(fault["type"]), str(fault["msg"]).removeprefix("Value error, "))


def _is_finite(value: Any) -> bool:
    """Whether a number, which may be text of the command line, is neither NaN nor infinite."""
    try:
        return math.isfinite(float(value))
    except (TypeError, ValueError, OverflowError):
        return True


def given(fault: dict[str, Any]) -> str:
    """Return the rejected value in brackets, if it fits into a line."""
    value = fault.get("input")
    return f" (got {value!r})" if isinstance(value, int | float | str | bool) else ""


def unit_hint(fault: dict[str, Any]) -> str:
    """Hint on a value that is too large, but allowed in the unit that people often use."""
    context = fault.get("ctx", {})
    most = context.get("le", context.get("lt"))
    unit = next(key for key in reversed(("", *fault["loc"])) if isinstance(key, str))[-4:]
    usual, factor = _USUAL_UNITS.get(unit.rpartition("_")[2], ("", math.inf))
    value = fault.get("input")
    if most is None or not isinstance(value, int | float) or abs(value * factor) > most:
        return ""
    return f"; {value:g} {usual} are {value * factor:.4g}"


def _pattern_in_words(pattern: str) -> str:
    """Return the message for a text that does not match."""
    if pattern in PATTERNS_IN_WORDS:
        return PATTERNS_IN_WORDS[pattern]
    letters = re.fullmatch(r"\^\[([a-z]+)\](?:\*|\{(\d+),(\d+)\})\$", pattern)
    if letters is not None:
        which, least, most = letters.groups()
        return f"must have the letters {' and '.join(which)} only" + (
            f", {least} to {most} of them" if least else ""
        )
    classes = re.fullmatch(r"\^(?:\[([^]]+)\])?\[([^]]+)\][*+]\$", pattern)
    if classes is None:
        return f"must match {pattern}"
    first, others = classes.groups()
    begin = f"must begin with {_class_in_words(first)}, and " if first else "must "
    return f"{begin}have only {_class_in_words(others)}"


def _class_in_words(characters: str) -> str:
    ranges = {"a-z": "small letters", "A-Z": "capital letters", "0-9": "digits"}
    words = [name for character_range, name in ranges.items() if character_range in characters]
    rest = re.sub("a-z|A-Z|0-9", "", characters)
    listed = words + [repr(character) for character in rest]
    return " or ".join([", ".join(listed[:-1]), listed[-1]] if len(listed) > 1 else listed)
