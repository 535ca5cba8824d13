"""``snakewalk robot identify``: a servo's constants from recordings, friction from runs."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean
from typing import Annotated, NamedTuple

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.key_types import SEED, Seed
from snakewalk.config.loader import checked, load_robot, load_world, with_keys
from snakewalk.config.robot import RobotConfig
from snakewalk.config.template import plain_toml, template
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.opened_log import open_log
from snakewalk.controller.console.options import (
    Force,
    Json,
    Robot,
    Workers,
    World,
    check_files,
    console,
    print_table,
)
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
)
from snakewalk.controller.studies.identification.law_fit import LawFit, fit_laws
from snakewalk.controller.studies.identification.pendulum_fit import (
    error_deg,
    fit_pendulum,
    robot_error_deg,
)
from snakewalk.controller.studies.identification.pendulum_log import PendulumLog, read_pendulum_log
from snakewalk.controller.studies.identification.servo_constants import (
    CONSTANTS,
    ServoConstants,
    bam_text,
    check_servo,
    ranges,
    read_bam,
    robot_comment,
    robot_with,
)


@command(
    "robot identify",
    examples=(
        "robot identify kp200.json kp800.json -o xl330.json",
        "robot identify kp200.json kp800.json --robot xl330-16 --robot-out mine.toml",
        "robot identify kp400.json kp800.json --backlash --robot xl330-16 --robot-out mine.toml",
        "robot identify kp400.json --start xl330.json --no-fit --json",
        "robot identify runs/flat-slalom-walk-seed0/log.mcap -o found.toml",
        "robot identify runs/NAME/log.mcap -o found.toml --robot-out mine.toml",
    ),
)
def identify(
    logs: Annotated[
        list[Path],
        typer.Argument(
            help="recordings of one servo with a pendulum (BAM's raw JSON), or logs of one "
            "robot's runs (.mcap)"
        ),
    ],
    judge: Annotated[
        list[Path] | None, typer.Option(help="recording used only for judging; may be repeated")
    ] = None,
    start: Annotated[
        Path | None, typer.Option(help="constants to begin with, as BAM writes them")
    ] = None,
    fit: Annotated[
        bool, typer.Option("--fit/--no-fit", help="fit, or only judge the constants of --start")
    ] = True,
    seed: Seed = SEED,
    backlash: Annotated[
        bool, typer.Option("--backlash", help="estimate the backlash of the gears, too")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            help="write constants as BAM's JSON, or friction as a world's TOML",
        ),
    ] = None,
    world: World = None,
    robot: Robot = None,
    robot_out: Annotated[
        Path | None,
        typer.Option(
            help="write the robot with the results: --robot with a servo's constants, or the "
            "robot of a run's log with its mass"
        ),
    ] = None,
    workers: Workers = 2,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Find a servo's constants from its pendulum, or friction and mass from logs of runs.

    Recordings of a servo give resistance, torque constant, friction, inertia and P unit. Logs
    of runs give the friction along and across the body, and its law, on the ground --world
    (default: that of the logs). With --robot-out, gaits that lift also give the mass. All results
    have 95 % intervals.
    """
    judge = judge or []
    of_runs = [path for path in (*logs, *judge) if (".mcap" in path.suffixes)]
    if of_runs:
        if len(of_runs) < len(logs) + len(judge):
            raise InputError(
                "logs of runs (.mcap) and recordings of a pendulum cannot be combined; give "
                "one kind"
            )
        if start is not None or not fit or backlash:
            raise InputError(
                "--start, --no-fit and --backlash: are for pendulums; for the log of a run use "
                "--world"
            )
        if robot is not None:
            raise InputError(
                "--robot is whose servo swings a pendulum; the robot of a run is in its log (.mcap)"
            )
        outs = _Outs(out, robot_out)
        _friction(logs, judge, world, outs, force=force, workers=workers, as_json=as_json)
        return
    if world is not None:
        raise InputError("--world is the ground of a run's log (.mcap); a pendulum has none")
    robot_file = _robot_file(robot, robot_out)
    if backlash and not fit:
        raise InputError("--backlash: needs a fit; remove --no-fit")
    search = _Search(start, seed, fit=fit, backlash=backlash)
    _servo(logs, judge, search, out, robot_file, force=force, as_json=as_json)


class _RobotFile(NamedTuple):
    """A robot to write with the results."""

    before: RobotConfig
    out: Path


class _Search(NamedTuple):
    """Constants to begin with, and which of them to fit."""

    start: Path | None
    seed: int
    fit: bool
    backlash: bool


class _Outs(NamedTuple):
    """Files for the results from logs of runs: ground and robot."""

    world: Path | None
    robot: Path | None


def _robot_file(robot: str | None, out: Path | None) -> _RobotFile | None:
    if robot is None and out is None:
        return None
    if robot is None or out is None:
        raise InputError(
            "--robot ROBOT and --robot-out FILE go together: the robot, and the file to write it "
            "to with the constants"
        )
    check_ending(out, "a robot's file (--robot-out)", ".toml")

    return _RobotFile(load_robot(robot), out)


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


def _friction(
    paths: list[Path],
    judge: list[Path],
    world: str | None,
    outs: _Outs,
    *,
    force: bool,
    workers: int,
    as_json: bool,
) -> None:

    require_extra("friction from a run's log needs", "mujoco")
    refuse_to_overwrite(outs, force)
    check_ending(outs.robot, "a robot's file (--robot-out)", ".toml")
    out = outs.world
    check_ending(out, "friction is a world's file, which", ".toml")
    check_files(None, None, world)
    given = None if world is None else load_world(world)
    logs = _read_runs(paths, judge, given, lifting=outs.robot is not None)
    first = logs[paths[0]].goals
    name = first.world.name if out is None else out.stem
    ground = checked(WorldConfig, first.world.model_dump() | {"name": name}, str(out))
    laws = None
    if first.world.ground.kind == "flat":
        with ProgressBar("laws of friction", transient=True) as bar:
            laws = fit_laws([logs[path] for path in paths], bar.update)
    if laws is not None and laws.is_decided:
        logs = {path: log.under(laws.best) for path, log in logs.items()}
        friction = ground.friction.model_copy(update={"law": laws.best})
        ground = ground.model_copy(update={"friction": friction})
    with ProgressBar("friction", transient=True) as bar:
        friction_fit = fit_friction(
            [logs[path] for path in paths],
            mass=outs.robot is not None,
            workers=workers,
            on_progress=bar.update,
        )
    if out is not None:
        text = template(friction_fit.world(ground), "\n".join(friction_fit.comment(paths)))
        write_result(out, text)
    if friction_fit.mass is not None and outs.robot is not None:
        _write_mass(outs.robot, first.robot, friction_fit.mass, paths)
    kept, _ = resistance_of(friction_fit.world(ground))
    _print_friction(friction_fit, laws, kept, logs, paths, outs, as_json=as_json)


def _print_friction(
    friction_fit: FrictionFit,
    laws: LawFit | None,
    kept: Resistance,
    logs: dict[Path, FrictionLog],
    paths: list[Path],
    outs: _Outs,
    *,
    as_json: bool,
) -> None:
    first = logs[paths[0]].goals
    out = outs.world
    assumed, names = resistance_of(first.world)
    table_key = "ground" if laws is None else "friction"
    errors = {str(path): (log.errors(assumed), log.errors(kept)) for path, log in logs.items()}
    settings = [f"world.{table_key}.{key}={getattr(kept, key):.4g}" for key in names]
    law = laws.best if laws is not None and laws.is_decided else None
    if law is not None:
        settings.append(f"world.friction.law={law}")
    fitted = {str(path) for path in paths}
    if as_json:
        result: dict[str, object] = {
            "law": law,
            "law_misfit": {} if laws is None else {k: round(v, 3) for k, v in laws.misfit.items()},
            "correlation": friction_fit.together,
            "friction": {key: estimate.value for key, estimate in friction_fit.found.items()},
            "interval_95": {
                key: [estimate.low, estimate.high] for key, estimate in friction_fit.found.items()
            },
            "not_told": [
                key for key, estimate in friction_fit.found.items() if not estimate.determined
            ],
            "settings": settings,
            "errors": {
                log_name: {
                    "way_mm": [round(1e3 * way_m, 3) for way_m, _ in both],
                    "turn_deg": [round(math.degrees(turn_rad), 3) for _, turn_rad in both],
                }
                for log_name, both in errors.items()
            },
            "fitted": [log_name for log_name in errors if log_name in fitted],
            "out": out and str(out),
        }
        if friction_fit.mass is not None:
            mass = friction_fit.mass.times(_spine_kg(first.robot))
            result |= {"mass_kg": mass.value, "mass_interval_95_kg": [mass.low, mass.high]}
            result["robot_out"] = str(outs.robot)
        print(json.dumps(result))
        return
    rows: list[tuple[str, ...]] = []
    for key, estimate in friction_fit.found.items():
        note = "" if estimate.determined else "not identified from these logs"
        interval = f"{estimate.low:.4g} to {estimate.high:.4g}"
        rows.append((key.replace("_", " "), f"{estimate.value:.4g}", interval, note))
    print_table(("friction", "value", "95 % interval", ""), rows)
    for log_name, ((before_m, before_rad), (after_m, after_rad)) in errors.items():
        console.print(
            f"{log_name}: in a second {1e3 * before_m:.1f} mm and {math.degrees(before_rad):.1f} "
            f"degrees off with the friction of {first.world.name}, {1e3 * after_m:.1f} mm and "
            f"{math.degrees(after_rad):.1f} degrees with this"
            f"{'' if log_name in fitted else ' (not fitted)'}"
        )
    for pair, correlation in friction_fit.together.items():
        combination = "ratio" if correlation > 0.0 else "product"
        console.print(
            f"{pair.replace('_', ' ')}: these logs hardly separate them (correlation "
            f"{correlation:.2f}); their {combination} is more accurate",
            soft_wrap=True,
        )
    if laws is not None:
        console.print(laws.text(), soft_wrap=True)
    console.print(" ".join(f"--set {setting}" for setting in settings), soft_wrap=True)
    if friction_fit.mass is not None:
        mass = friction_fit.mass.times(_spine_kg(first.robot))
        console.print(
            f"{outs.robot}: the links weigh {mass.value:.4g} kg, 95 % of {mass.low:.4g} to "
            f"{mass.high:.4g}; {first.robot.name} has {_spine_kg(first.robot):.4g}",
            soft_wrap=True,
        )


def _spine_kg(robot: RobotConfig) -> float:
    return robot.mean_link_mass_kg * robot.link_count


def _write_mass(out: Path, robot: RobotConfig, mass: Found, paths: list[Path]) -> None:

    after = with_mass(robot, float(f"{mass.value:.4g}")).model_copy(update={"name": out.stem})
    comment = (
        f"Mass found by `snakewalk robot identify` from {', '.join(map(str, paths))}:\n"
        f"{mass.value:.4g} times that of {robot.name}, 95 % of {mass.low:.4g} to {mass.high:.4g}"
    )
    write_result(out, plain_toml(after, comment))


def _check_one_servo(logs: Sequence[PendulumLog]) -> None:
    if len({log.actuator for log in logs}) > 1:
        names = ", ".join(sorted({log.actuator or "?" for log in logs}))
        raise InputError(f"the recordings are of several servos: {names}; give those of one")


def _servo(
    logs: list[Path],
    judge: list[Path],
    search: _Search,
    out: Path | None,
    robot_file: _RobotFile | None,
    *,
    force: bool,
    as_json: bool,
) -> None:
    start = search.start
    fit = search.fit
    if not fit and start is None:
        raise InputError("--no-fit judges constants: give them with --start FILE")
    refuse_to_overwrite([out, robot_file and robot_file.out], force)
    fitted = [read_pendulum_log(path) for path in logs]
    judged = [read_pendulum_log(path) for path in judge]
    start_constants = None if start is None else read_bam(start)
    _check_one_servo((*fitted, *judged))
    if robot_file is not None:  # before a minute of fits, whether the servo is the robot's
        check_servo(
            robot_file.before,
            fitted[0].actuator if start_constants is None else start_constants.actuator,
        )
    if fit or start_constants is None:
        with ProgressBar("fits", transient=True) as bar:
            start_constants = fit_pendulum(
                fitted,
                start_constants,
                seed=search.seed,
                backlash=search.backlash,
                on_progress=bar.update,
            )
    if out is not None:
        write_result(out, bam_text(start_constants))
    forecasts = {}
    if robot_file is not None:
        after = _write_robot(robot_file, start_constants, logs)
        forecasts = {
            str(log.path): [
                round(robot_error_deg(robot, log, start_constants), 3)
                for robot in (robot_file.before, after)
            ]
            for log in (*fitted, *judged)
        }
    errors = {
        str(log.path): (round(error_deg(start_constants, log), 3), fit and k < len(fitted))
        for k, log in enumerate((*fitted, *judged))
    }
    mean_deg = round(fmean(error for error, _ in errors.values()), 3)
    rows = list(
        zip(
            CONSTANTS,
            start_constants.values,
            start_constants.low,
            start_constants.high,
            strict=True,
        )
    )
    reached = _reached_bounds(start_constants) if fit else {}
    if as_json:
        result = {
            "actuator": start_constants.actuator,
            "constants": {c.name: float(value) for c, value, _, _ in rows},
            "interval_95": {
                c.name: [float(low), float(high)] for c, _, low, high in rows if math.isfinite(low)
            },
            "mean_error_deg": mean_deg,
            "errors_deg": {path: error for path, (error, _) in errors.items()},
            "fitted": [path for path, (_, used) in errors.items() if used],
            "on_bound": {name: bound for name, (bound, _) in reached.items()},
            "out": out and str(out),
        }
        if robot_file is not None:
            result |= {"robot_out": str(robot_file.out), "robot_errors_deg": forecasts}
        print(json.dumps(result))
        return
    _print_constants(start_constants, reached)
    for path, (error, used) in errors.items():
        console.print(
            f"{path}: {error:.2f} degrees off on average{'' if used else ' (not fitted)'}"
        )
    console.print(f"mean {mean_deg:.2f} degrees")
    if robot_file is not None:
        before_deg, after_deg = (
            fmean(forecast) for forecast in zip(*forecasts.values(), strict=True)
        )
        console.print(
            f"{robot_file.out}: its simulated servo is {after_deg:.2f} degrees off on average, "
            f"that of {robot_file.before.name} {before_deg:.2f}",
            soft_wrap=True,
        )


def _reached_bounds(constants: ServoConstants) -> dict[str, tuple[float, str]]:
    """Return the constants on an end of their range, and warn of each."""
    reached = ranges(constants.actuator).bounds_reached(constants.values)
    for name, (bound, which) in reached.items():
        LOGGER.warning(
            "%s: %g is the %s end of its range, so other constants may be wrong, too; check mass, "
            "arm and supply, and do not use the result for another load",
            name,
            bound,
            which,
        )
    return reached


def _print_constants(constants: ServoConstants, reached: dict[str, tuple[float, str]]) -> None:
    rows: list[tuple[str, ...]] = []
    for constant, value, low, high in zip(
        CONSTANTS, constants.values, constants.low, constants.high, strict=True
    ):
        interval = f"{low:.4g} to {high:.4g}" if math.isfinite(low) else "-"
        note = f"{reached[constant.name][1]} end of the range" if constant.name in reached else ""
        rows.append((constant.name.replace("_", " "), f"{value:.4g}", interval, note))
    print_table(("constant", "value", "95 % interval", ""), rows)


def _write_robot(file: _RobotFile, constants: ServoConstants, logs: list[Path]) -> RobotConfig:

    after = with_keys(robot_with(file.before, constants), {"name": file.out.stem}, str(file.out))
    write_result(file.out, plain_toml(after, robot_comment(constants, logs)))
    return after
