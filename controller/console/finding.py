"""One line of the doctor's report."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Literal

Grade = Literal["ok", "warn", "fail"]


@dataclass(frozen=True, slots=True)
class Finding:
    """Result of one check."""

    check: str
    grade: Grade
    found: str
    remedy: str = ""
    """Remedy; empty if all is well."""

    def to_dict(self) -> dict[str, str]:
        """Fields for JSON."""
        return asdict(self)


def worst(findings: list[Finding]) -> Grade:
    """Worst grade of the findings."""
    grades = {finding.grade for finding in findings}
    return "fail" if "fail" in grades else "warn" if "warn" in grades else "ok"


def shown_ids(servo_ids: Sequence[int]) -> str:
    """``servo 3``, ``servos 1 to 4, 7``."""
    numbers = sorted(servo_ids)
    spans: list[list[int]] = []
    for number in numbers:
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    shown = [f"{a}" if a == b else f"{a}, {b}" if b == a + 1 else f"{a} to {b}" for a, b in spans]
    return f"servo{'s' if len(numbers) > 1 else ''} {', '.join(shown)}"


def shown_subject(
    servo_ids: Sequence[int], verb: str, label: Callable[[int], str] | None = None
) -> str:
    """``servo 3 answers``, ``servos 1 to 4 answer``; ``verb`` is plural.

    ``label`` returns the text for a single servo with a known joint.
    """
    irregular = {
        **{"have": "has", "are": "is", "reply": "replies", "switch": "switches"},
        **{"do not reply": "does not reply", "cannot": "cannot"},
    }
    verb_form = irregular.get(verb, f"{verb}s")
    if len(servo_ids) > 1:
        return f"{shown_ids(servo_ids)} {verb}"
    return f"{shown_ids(servo_ids) if label is None else label(servo_ids[0])} {verb_form}"
