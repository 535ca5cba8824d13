"""``python -m tests.campaign``: all scenarios; writes the table of docs/campaign.md."""

import argparse
import shlex
import sys
from itertools import count
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from tests.campaign.campaign import campaign
from tests.campaign.report import BEGIN, END, table
from tests.campaign.scenarios import SCENARIOS

DOC = Path(__file__).resolve().parents[2] / "docs" / "campaign.md"


def main() -> None:
    """Run until the number of cycles is reached, then write the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--cycles", type=int, default=100_000, help="at least so many in all")
    options.add_argument("--each", type=int, default=240, help="cycles a scenario")
    options.add_argument("--first-seed", type=int, default=0, help="of the first round")
    options.add_argument("--doc", type=Path, default=DOC, help="file with the table")
    options.add_argument("--alone", action="store_true", help="no pairs; changes no page")
    options.add_argument("--sound", type=int, default=0, help="so many scenarios without a fault")
    given = options.parse_args()
    if given.sound:
        _sound(given.first_seed, given.sound, given.each)
        return
    scenarios = [kinds for kinds in SCENARIOS if len(kinds) < 2] if given.alone else SCENARIOS
    rounds = -(-given.cycles // (given.each * len(scenarios)))
    end = given.first_seed + rounds
    jobs = [(kinds, seed) for seed in range(given.first_seed, end) for kinds in scenarios]
    with Progress(console=Console(stderr=True)) as progress:
        bar = progress.add_task("fault campaign", total=len(jobs))
        whole, by_kind = campaign(jobs, given.each, lambda: progress.advance(bar))
    # scenarios that end early are made up for
    for seed in count(end):
        if whole.cycles >= given.cycles:
            break
        more, by_more = campaign([(kinds, seed) for kinds in scenarios], given.each)
        whole.add(more)
        for kind, tally in by_more.items():
            by_kind[kind].add(tally)
    command = shlex.join(["python", "-m", "tests.campaign", *sys.argv[1:]])
    shown = f"    {command}\n\n{table(whole, by_kind)}"
    print(shown)
    for line in whole.complaints[:40]:
        print(line)
    if given.doc.is_file() and not given.alone:
        text = given.doc.read_text(encoding="utf-8")
        head, tail = text.split(BEGIN)[0], text.split(END)[-1]
        given.doc.write_text(f"{head}{BEGIN}\n{shown}\n{END}{tail}", encoding="utf-8")
    if whole.violations:
        raise SystemExit(1)


def _sound(first_seed: int, count: int, cycles: int) -> None:
    """Run scenarios without a fault, and report false alarms and trips."""
    whole, _ = campaign([((), seed) for seed in range(first_seed, first_seed + count)], cycles)
    wrong = whole.false_alarms + whole.brought_back
    print(
        f"{count} scenarios without a fault, {whole.cycles:,} cycles, {whole.values:,} values: "
        f"{wrong} false alarms; {whole.trips} trips by commands that are not numbers"
    )
    print(*whole.complaints[:40], sep="\n")
    if whole.violations or wrong:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
