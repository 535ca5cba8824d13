"""``snakewalk animal graph``: rules of walking compared on graphs of states."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.key_types import SEED, Seed
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, print_table
from snakewalk.controller.console.progress import show_progress
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.shape.walks import RULES, check_rule
from snakewalk.controller.studies.commands.pictures import pictures
from snakewalk.controller.studies.graph_study import graph_source, run_study

if TYPE_CHECKING:
    from snakewalk.controller.studies.graph_study import StudyResult


@command(
    "animal graph",
    examples=(
        "animal graph",
        "animal graph --graph er:1000:9 --rule snake --rule stack --repeats 30 --json",
    ),
    results=("picture",),
)
def walk(
    graph: Annotated[
        list[str] | None,
        typer.Option(
            help="random er:STATES:DEGREE, small world ws:STATES:DEGREE:REWIRED, shapes "
            "kp:TRACK[:THRESHOLD], or a file; may be repeated; default: er:1000:9"
        ),
    ] = None,
    rule: Annotated[
        list[str] | None,
        typer.Option(
            help="rule: snake, snake-printed, frontier, stack, random or degree; may be "
            "repeated; default: all"
        ),
    ] = None,
    repeats: Annotated[
        int, typer.Option(min=1, max=100_000, help="number of graphs of each kind")
    ] = 30,
    seed: Seed = SEED,
    picture: Annotated[
        Path | None, typer.Option(help="draw states seen over steps here (.png, .svg, .pdf)")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Walk graphs of states until all are visited: number of steps, and how soon states repeat."""
    check_picture(picture)

    graphs = graph or ["er:1000:9"]
    rules = rule or list(RULES)
    for spec in graphs:  # refuse bad input before any work starts
        graph_source(spec)
    for name in rules:
        check_rule(name)
    cases = [(spec, name) for spec in dict.fromkeys(graphs) for name in dict.fromkeys(rules)]
    results = [
        run_study(spec, name, repeats, seed)
        for spec, name in show_progress(cases, "walks", len(cases))
    ]
    if picture is not None:
        pictures().draw_walks(results, picture)
    if as_json:
        print(json.dumps([result.to_dict() for result in results]))
        return
    _print(results)


def _print(results: "list[StudyResult]") -> None:
    heads = "graph,|V|,degree,rule,mean,95 %,worst,seen at,back in,of all,over |V|"
    rows = []
    for result in results:
        row = result.to_dict()
        rows.append(
            (
                result.graph,
                f"{row['states']:.0f}",
                f"{row['mean_degree']:.2f}",
                result.rule,
                "never" if row["cover_mean"] is None else f"{row['cover_mean']:.3f}",
                None if row["cover_ci95"] is None else f"±{row['cover_ci95']:.3f}",
                None if row["cover_worst"] is None else f"{row['cover_worst']:.2f}",
                f"{row['seen_at_v']:.0%}",
                f"{row['short_returns']:.1%}",
                f"{row['short_steps']:.1%}",
                f"{row['short_per_state']:.3f}",
            )
        )
    title = f"Steps until all states are seen, over |V|; {results[0].repeats} graphs of each kind"
    print_table(heads.split(","), rows, title)
