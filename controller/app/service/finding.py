"""One line of the doctor's report."""

from dataclasses import asdict, dataclass
from typing import Literal

Grade = Literal["ok", "warn", "fail"]


@dataclass(frozen=True, slots=True)
class Finding:
    """What one check found."""

    check: str
    grade: Grade
    found: str
    remedy: str = ""
    """What to do; empty where all is well."""

    def to_dict(self) -> dict[str, str]:
        """For JSON."""
        return asdict(self)


def worst(findings: list[Finding]) -> Grade:
    """Grade of the whole."""
    grades = {finding.grade for finding in findings}
    return "fail" if "fail" in grades else "warn" if "warn" in grades else "ok"
