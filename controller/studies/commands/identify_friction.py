"""Friction and mass from logs of runs, for ``snakewalk robot identify``."""

import json
import math
from pathlib import Path
from typing import Any, NamedTuple

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.loader import checked, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.config.template import plain_toml, template
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.opened_log import open_log
from snakewalk.controller.console.options import check_files, console, print_table
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import (
    check_ending,
    refuse_to_overwrite,
    write_result,
)
from snakewalk.controller.studies.identification.friction_fit import (
    Found,
    FrictionFit,
    FrictionLog,
    Resistance,
    fit_friction,
    resistance_of,
    with_mass,
    with_resistance,
)
from snakewalk.controller.studies.identification.law_fit import LawFit, fit_laws
from snakewalk.controller.studies.shadow.diagnosis import Goals


class FrictionFiles(NamedTuple):
    """Files for the results from logs of runs: ground and robot."""

    world: Path | None
    robot: Path | None


def identify_friction(
    paths: list[Path],
    judge: list[Path],
    world: str | None,
    files: FrictionFiles,
    *,
    force: bool,
    workers: int,
    as_json: bool,
) -> None:
    """Fit the friction to logs of runs, and the mass if ``files`` names a robot; print it."""
    require_extra("friction from a run's log needs", "mujoco")
    refuse_to_overwrite(files, force)
    check_ending(files.robot, "a robot's file (--robot-out)", ".toml")
    check_ending(files.world, "friction is a world's file, which", ".toml")
    check_files(None, None, world)
    given = None if world is None else load_world(world)
    logs = _read_runs(paths, judge, given, lifting=files.robot is not None)
    first = logs[paths[0]].goals
    name = first.world.name if files.world is None else files.world.stem
    ground = checked(WorldConfig, first.world.model_dump() | {"name": name}, str(files.world))
    laws = _laws([logs[path] for path in paths])
    if laws is not None and laws.is_decided:
        logs = {path: log.under(laws.best) for path, log in logs.items()}
        first = logs[paths[0]].goals
        ground = with_resistance(ground, first.world.friction)
    with ProgressBar("friction", transient=True) as bar:
        fit = fit_friction(
            [logs[path] for path in paths],
            mass=files.robot is not None,
            workers=workers,
            on_progress=bar.update,
        )
    ground = fit.world(ground)
    if files.world is not None:
        write_result(files.world, template(ground, "\n".join(fit.comment(paths))))
    if fit.mass is not None and files.robot is not None:
        _write_mass(files.robot, first.robot, fit.mass, paths)
    friction, _ = resistance_of(ground)
    assumed, _ = resistance_of(first.world)
    summary = {
        **_fitted(fit, first.robot, files),
        **_settings(friction, laws, first.world),
        "errors": {
            str(path): _errors(log.errors(assumed), log.errors(friction))
            for path, log in logs.items()
        },
        "fitted": [str(path) for path in paths],
        "out": files.world and str(files.world),
    }
    if as_json:
        print(json.dumps(summary))
    else:
        _print(summary, first, laws)


def _laws(logs: list[FrictionLog]) -> LawFit | None:
    """Compare the laws of friction; None where the ground is not flat."""
    if logs[0].goals.world.ground.kind != "flat":
        return None
    with ProgressBar("laws of friction", transient=True) as bar:
        return fit_laws(logs, bar.update)


def _read_runs(
    paths: list[Path], judge: list[Path], given: WorldConfig | None, *, lifting: bool
) -> dict[Path, FrictionLog]:
    logs = {}
    for path in (*paths, *judge):
        record = open_log(path)
        try:
            logs[path] = FrictionLog.of(record, given)
            if lifting and path in paths:
                logs[path].check_lifts()
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    first = next(iter(logs.values())).goals
    for path, log in logs.items():
        if log.goals.robot != first.robot or resistance_of(log.goals.world) != resistance_of(
            first.world
        ):
            raise InputError(
                f"{path}: is of another robot or another friction than {paths[0]}; give logs of "
                "one robot, and --world WORLD if their worlds differ"
            )
    return logs


def _write_mass(out: Path, robot: RobotConfig, mass: Found, paths: list[Path]) -> None:
    after = with_mass(robot, float(f"{mass.value:.4g}")).model_copy(update={"name": out.stem})
    comment = (
        f"Mass found by `snakewalk robot identify` from {', '.join(map(str, paths))}:\n"
        f"{mass.value:.4g} times that of {robot.name}, 95 % of {mass.low:.4g} to {mass.high:.4g}"
    )
    write_result(out, plain_toml(after, comment))


def _settings(friction: Resistance, laws: LawFit | None, world: WorldConfig) -> dict[str, Any]:
    """Return the law, and the settings that give a run this friction."""
    _, names = resistance_of(world)
    table = "ground" if laws is None else "friction"
    settings = [f"world.{table}.{key}={getattr(friction, key):.4g}" for key in names]
    law = laws.best if laws is not None and laws.is_decided else None
    if law is not None:
        settings.append(f"world.friction.law={law}")
    misfit = {} if laws is None else {key: round(value, 3) for key, value in laws.misfit.items()}
    return {"law": law, "law_misfit": misfit, "settings": settings}


def _fitted(fit: FrictionFit, robot: RobotConfig, files: FrictionFiles) -> dict[str, Any]:
    """Return friction and mass with their intervals."""
    fitted: dict[str, Any] = {
        "correlation": fit.together,
        "friction": {key: estimate.value for key, estimate in fit.found.items()},
        "interval_95": {key: [estimate.low, estimate.high] for key, estimate in fit.found.items()},
        "not_told": [key for key, estimate in fit.found.items() if not estimate.determined],
    }
    if fit.mass is not None:
        mass = fit.mass.times(_spine_kg(robot))
        fitted |= {"mass_kg": mass.value, "mass_interval_95_kg": [mass.low, mass.high]}
        fitted["robot_out"] = str(files.robot)
    return fitted


def _errors(*before_and_after: tuple[float, float]) -> dict[str, list[float]]:
    return {
        "way_mm": [round(1e3 * way_m, 3) for way_m, _ in before_and_after],
        "turn_deg": [round(math.degrees(turn_rad), 3) for _, turn_rad in before_and_after],
    }


def _print(summary: dict[str, Any], first: Goals, laws: LawFit | None) -> None:
    rows: list[tuple[str, ...]] = []
    for key, value in summary["friction"].items():
        note = "not identified from these logs" if key in summary["not_told"] else ""
        low, high = summary["interval_95"][key]
        rows.append((key.replace("_", " "), f"{value:.4g}", f"{low:.4g} to {high:.4g}", note))
    print_table(("friction", "value", "95 % interval", ""), rows)
    for log_name, errors in summary["errors"].items():
        before_mm, after_mm = errors["way_mm"]
        before_deg, after_deg = errors["turn_deg"]
        console.print(
            f"{log_name}: in a second {before_mm:.1f} mm and {before_deg:.1f} "
            f"degrees off with the friction of {first.world.name}, {after_mm:.1f} mm and "
            f"{after_deg:.1f} degrees with this"
            f"{'' if log_name in summary['fitted'] else ' (not fitted)'}"
        )
    for pair, correlation in summary["correlation"].items():
        combination = "ratio" if correlation > 0.0 else "product"
        console.print(
            f"{pair.replace('_', ' ')}: these logs hardly separate them (correlation "
            f"{correlation:.2f}); their {combination} is more accurate",
            soft_wrap=True,
        )
    if laws is not None:
        console.print(laws.text(), soft_wrap=True)
    console.print(" ".join(f"--set {setting}" for setting in summary["settings"]), soft_wrap=True)
    if "mass_kg" in summary:
        low, high = summary["mass_interval_95_kg"]
        console.print(
            f"{summary['robot_out']}: the links weigh {summary['mass_kg']:.4g} kg, 95 % of "
            f"{low:.4g} to {high:.4g}; {first.robot.name} has {_spine_kg(first.robot):.4g}",
            soft_wrap=True,
        )


def _spine_kg(robot: RobotConfig) -> float:
    return robot.mean_link_mass_kg * robot.link_count
