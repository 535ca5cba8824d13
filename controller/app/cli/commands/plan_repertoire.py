"""``snakewalk plan --with repertoire``: a run as a sequence of recorded actions."""

from pathlib import Path

from snakewalk.config.extras import require_extra
from snakewalk.controller.app.cli.commands.repertoire import bar, carry_out
from snakewalk.controller.app.cli.options import show
from snakewalk.controller.app.result_files import refuse_to_overwrite


def plan_with_repertoire(
    run: str,
    *,
    repertoire: Path | None,
    robot: str | None,
    world: str | None,
    beam: int,
    physics: int,
    out: Path | None,
    carry: bool,
    force: bool,
    as_json: bool,
) -> None:
    """Search, show, and where asked save, time on the physics, and run."""
    from snakewalk.controller.app.studies.repertoire_planning import (  # noqa: PLC0415  heavy; --help stays quick
        plan_facts,
        plan_route,
        save_plan,
        search_cost,
    )

    refuse_to_overwrite([out], force)
    if physics or carry:
        require_extra("candidates and runs on the physics need", "mujoco")
    job = plan_route(run, repertoire, robot=robot, world=world, beam=beam)
    found = plan_facts(job)
    if not as_json:
        found["actions"] = ", ".join(job.action_names)
    if physics:
        with bar() as progress:
            task = progress.add_task("candidates on the physics", total=physics)
            cost = search_cost(
                job,
                physics,
                beam=beam,
                on_progress=lambda done: progress.update(task, completed=done),
            )
        found |= cost.facts()
    if out is not None:
        save_plan(job, out)
        found["plan"] = str(out)
    complete = True
    if carry:
        found["ran"], complete = carry_out(job, None, None, False, None)
    show(found, as_json)
    if not complete:
        raise SystemExit(1)
