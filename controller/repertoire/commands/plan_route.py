"""``snakewalk plan --with repertoire``: a plan of recorded actions."""

from pathlib import Path

from snakewalk.config.extras import require_extra
from snakewalk.controller.console.command import plugin
from snakewalk.controller.console.options import show
from snakewalk.controller.console.result_files import refuse_to_overwrite
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.repertoire.commands.repertoire_run import run_route
from snakewalk.controller.repertoire.repertoire_planning import (
    plan_facts,
    plan_route,
    save_plan,
)


@plugin("planner", "repertoire")
def plan_with_repertoire(
    run: str,
    *,
    repertoire: Path | None,
    robot: str | None,
    world: str | None,
    beam: int,
    out: Path | None,
    carry: bool,
    force: bool,
    as_json: bool,
) -> None:
    """Search over recorded actions; show the plan, and where asked save and run it."""
    refuse_to_overwrite([out], force)
    if carry:
        require_extra("runs on the physics need", "mujoco")
    job = plan_route(run, repertoire, robot=robot, world=world, beam=beam)
    facts = plan_facts(job)
    if not as_json:
        facts["actions"] = ", ".join(job.action_names)
    if out is not None:
        save_plan(job, out)
        facts["plan"] = str(out)
    complete = True
    if carry:
        facts["ran"], complete = run_route(job, None, RunOptions(film=False, force=force))
    show(facts, as_json)
    if not complete:
        raise SystemExit(1)
