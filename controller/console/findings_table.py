"""Findings as a table, or as JSON; a fault ends the command with exit code 1."""

import json
from collections.abc import Mapping

from rich.table import Table
from rich.text import Text

from snakewalk.controller.console.finding import Finding, worst
from snakewalk.controller.console.options import console

_COLOURS = {"ok": "green", "warn": "yellow", "fail": "red"}


def show_findings(findings: list[Finding], facts: Mapping[str, object], as_json: bool) -> None:
    """Print findings; in JSON after ``facts``.

    Raises:
        SystemExit: with 1 after a fault.

    """
    grade = worst(findings)
    if as_json:
        shown = [finding.to_dict() for finding in findings]
        print(json.dumps({**facts, "worst": grade, "findings": shown}))
    else:
        table = Table(box=None, show_header=False)
        for finding in findings:
            mark = Text(finding.grade, style=_COLOURS[finding.grade])
            table.add_row(mark, finding.check, Text(finding.found))
            if finding.remedy:
                table.add_row("", "", Text(f"-> {finding.remedy}", style="bold"))
        console.print(table)
    if grade == "fail":
        raise SystemExit(1)
