"""The campaign's table, by kind of fault."""

from tests.campaign.campaign import Tally

BEGIN, END = "<!-- campaign begins -->", "<!-- campaign ends -->"
_COLUMNS = {
    "cycles": "cycles",
    "missing": "not read",
    "trips": "trips",
    "noticed": "changes named",
    "ended_otherwise": "ended otherwise",
    "violations": "violations",
}
_TOTALS = {
    "values": "values read",
    "clamped": "clamped",
    "brought_back": "brought back",
    "unsafe_trips": "trips not ending safe",
    "beyond_limit": "beyond a limit",
    "too_fast": "too fast",
    "old": "old for new",
    "foreign": "another's",
    "not_held": "not held",
    "too_long": "hangs",
    "unnoticed": "unnoticed",
    "false_alarms": "false alarms",
    "raced": "raced",
}


def table(whole: Tally, by_kind: dict[str, Tally]) -> str:
    """Markdown: a row for each kind, then the counts of all kinds together."""
    lines = _head(["fault", *_COLUMNS.values()])
    for name, tally in (*sorted(by_kind.items()), ("**all**", whole)):
        lines.append(_row(name.replace("_", " "), tally, _COLUMNS))
    lines += ["", *_head(["all kinds", *_TOTALS.values()])]
    return "\n".join([*lines, _row("count", whole, _TOTALS)])


def _head(columns: list[str]) -> list[str]:
    return ["| " + " | ".join(columns) + " |", "| --- |" + " ---: |" * (len(columns) - 1)]


def _row(name: str, tally: Tally, columns: dict[str, str]) -> str:
    cells = " | ".join(f"{getattr(tally, column):,}" for column in columns)
    return f"| {name} | {cells} |"
