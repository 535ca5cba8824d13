"""``snakewalk plan``: a run on paper."""

from controller.app.commands.common import DEFAULT_RUN, Json, Motion, RunName, Seed, show


def plan(
    run: RunName = DEFAULT_RUN, seed: Seed = None, motion: Motion = None, as_json: Json = False
) -> None:
    """Judge a run on paper: library, path and joint limits, with no servo and no simulator."""
    from controller.app.prepare import prepare  # noqa: PLC0415  heavy; --help stays quick

    prepared = prepare(run, seed=seed, motion=motion)
    ahead = prepared.forecast()
    found: dict[str, object] = {
        "run": prepared.run.name,
        "robot": prepared.robot.name,
        "motion": prepared.run.motion,
        "seed": prepared.run.seed,
        "waypoints": len(prepared.run.waypoints_m),
        "waypoints_reached": ahead.reached,
        "passed_by": ahead.missed,
        "path_m": round(prepared.path.length_m, 3),
        "duration_s": round(ahead.duration_s, 2),
        "joint_speed_rad_s": round(float(ahead.joint_speed_rad_s.max()), 3),
        "joint_reach_rad": round(float(abs(ahead.joint_rad).max()), 3),
        "predicted_gain": round(prepared.gain, 3),
    }
    if prepared.run.motion != "serpenoid":
        found["states"] = prepared.library.counts
    show(found, as_json)
