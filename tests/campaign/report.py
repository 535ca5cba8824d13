"""The campaign's table, by kind of fault."""

from tests.campaign.campaign import Tally

BEGIN, END = "<!-- campaign begins -->", "<!-- campaign ends -->"
_COLUMNS = {
    "cycles": "cycles",
    "values": "values read",
    "missing": "not read",
    "clamped": "clamped",
    "trips": "trips",
    "brought_back": "brought back",
    "unsafe_trips": "trips not ending safe",
    "beyond_limit": "beyond a limit",
    "too_fast": "too fast",
    "old": "old for new",
    "foreign": "another's",
    "not_held": "not held",
    "too_long": "hangs",
    "noticed": "changes named",
    "ended_otherwise": "ended otherwise",
    "unnoticed": "unnoticed",
    "false_alarms": "false alarms",
    "raced": "raced",
}


def table(whole: Tally, by_kind: dict[str, Tally]) -> str:
    """Markdown."""
    lines = [
        "| fault | " + " | ".join(_COLUMNS.values()) + " |",
        "| --- |" + " ---: |" * len(_COLUMNS),
    ]
    for name, tally in (*sorted(by_kind.items()), ("**all**", whole)):
        cells = " | ".join(f"{getattr(tally, column):,}" for column in _COLUMNS)
        lines.append(f"| {name.replace('_', ' ')} | {cells} |")
    return "\n".join(lines)
