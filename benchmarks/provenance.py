"""Where the figures of a page come from, and how they get there."""

import os
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"


def provenance(command: str) -> str:
    """Command, commit, machine and date of a measurement, as a paragraph of a page."""
    day = datetime.now(UTC).strftime("%Y-%m-%d")
    machine = f"{_processor()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    return f"`{command}`, commit `{_commit()}`, {machine}, {day}."


def page_of(name: str) -> Path:
    """Return the page with a subject's figures: of its own, or the subject's page."""
    own = DOCS / "benchmarks" / f"{name}.md"
    return own if own.exists() else DOCS / f"{name}.md"


def write_tables(page_name: str, name: str, text: str) -> None:
    """Replace what a page has between the marks of ``name``.

    Raises:
        ValueError: the page has no such marks.

    """
    page = page_of(page_name)
    begin, end = f"<!-- {name} begins -->", f"<!-- {name} ends -->"
    old = page.read_text(encoding="utf-8")
    if begin not in old or end not in old:
        raise ValueError(f"{page}: has no marks of {name}; add {begin} and {end}")
    head, tail = old.split(begin)[0], old.split(end)[-1]
    page.write_text(f"{head}{begin}\n{text}\n{end}{tail}", encoding="utf-8")


def _commit() -> str:
    def git(*words: str) -> str:
        told = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True)
        return told.stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", "*.py")
    return git("rev-parse", "--short=10", "HEAD") + (" with changes" if changed else "")


def _processor() -> str:
    """Model of the processor; its architecture where the system does not report it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.machine()
