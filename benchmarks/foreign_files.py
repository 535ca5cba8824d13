"""Reads every generated file of another program, and prints the table of the verdicts.

``python -m benchmarks.foreign_files --write`` puts it into ``docs/benchmarks/foreign-files.md``.
"""

import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.foreign.case import SOURCES, Case, Judgement, judge
from tests.foreign.every import every_case

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks" / "foreign-files.md"
BEGIN, END = "<!-- generated begins -->", "<!-- generated ends -->"
VERDICTS = ("right", "asked", "misleading", "silent")


def table(judged: list[tuple[Case, Judgement]], cpu_s: float) -> str:
    """Return the rows of all kinds, and the cases that are not correct."""
    lines = [
        "| kind | files | read, all is stated | read otherwise | asked or rejected | misleading "
        "| silent | statements are defined by |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |",
    ]
    total: Counter[str] = Counter()
    for kind, source in SOURCES.items():
        mine = [judgement for case, judgement in judged if case.kind == kind]
        count = Counter(judgement.verdict for judgement in mine)
        count["stated"] = sum(judgement.states_all for judgement in mine)
        count["files"] = len(mine)
        total += count
        lines.append(f"| {kind} | {_cells(count)} | {source} |")
    lines.append(f"| all | {_cells(total)} | |")
    wrong = [
        f"- {case.name}: {judgement.verdict}: {judgement.words}"
        for case, judgement in judged
        if judgement.verdict not in VERDICTS[:2]
    ]
    words = f"{total['files']} files, {cpu_s:.0f} s of CPU time, Python {sys.version.split()[0]}."
    return "\n".join([*lines, "", words, *wrong])


def _cells(count: Counter[str]) -> str:
    other = count["right"] - count["stated"]
    cells = (count["files"], count["stated"], other, *(count[name] for name in VERDICTS[1:]))
    return " | ".join(map(str, cells))


def main() -> None:
    """Judge all cases; print or write the table."""
    start_s = time.process_time()
    judged = []
    with tempfile.TemporaryDirectory() as folder:
        for number, case in enumerate(every_case()):
            judged.append((case, judge(case, Path(folder) / str(number))))
    text = table(judged, time.process_time() - start_s)
    if "--write" in sys.argv:
        page = PAGE.read_text(encoding="utf-8")
        before, rest = page.split(BEGIN)
        after = rest.split(END)[1]
        PAGE.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
