"""Constants of a servo from recordings of its pendulum, for ``snakewalk robot identify``."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean
from typing import Any, NamedTuple

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, with_keys
from snakewalk.config.robot import RobotConfig
from snakewalk.config.template import plain_toml
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import console, print_table
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import (
    check_ending,
    refuse_to_overwrite,
    write_result,
)
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


class RobotFile(NamedTuple):
    """A robot to write with the results."""

    before: RobotConfig
    out: Path


class FitOptions(NamedTuple):
    """Constants to begin with, and which of them to fit."""

    start: Path | None
    seed: int
    fit: bool
    backlash: bool


def robot_file(robot: str | None, out: Path | None) -> RobotFile | None:
    """Return the robot to write with the results, if one is asked for."""
    if robot is None and out is None:
        return None
    if robot is None or out is None:
        raise InputError(
            "--robot ROBOT and --robot-out FILE go together: the robot, and the file to write it "
            "to with the constants"
        )
    check_ending(out, "a robot's file (--robot-out)", ".toml")
    return RobotFile(load_robot(robot), out)


def identify_servo(
    logs: list[Path],
    judge: list[Path],
    search: FitOptions,
    out: Path | None,
    robot: RobotFile | None,
    *,
    force: bool,
    as_json: bool,
) -> None:
    """Fit the constants of a servo to its recordings, or only judge given ones; print them."""
    if not search.fit and search.start is None:
        raise InputError("--no-fit judges constants: give them with --start FILE")
    refuse_to_overwrite([out, robot and robot.out], force)
    fitted = [read_pendulum_log(path) for path in logs]
    recordings = [*fitted, *(read_pendulum_log(path) for path in judge)]
    _check_one_servo(recordings)
    constants = None if search.start is None else read_bam(search.start)
    if robot is not None:  # before a minute of fits, whether the servo is the robot's
        first = fitted[0] if constants is None else constants
        check_servo(robot.before, first.actuator)
    if search.fit or constants is None:
        with ProgressBar("fits", transient=True) as bar:
            constants = fit_pendulum(
                fitted,
                constants,
                seed=search.seed,
                backlash=search.backlash,
                on_progress=bar.update,
            )
    if out is not None:
        write_result(out, bam_text(constants))
    reached = _reached_bounds(constants) if search.fit else {}
    errors_deg = {str(log.path): round(error_deg(constants, log), 3) for log in recordings}
    summary = {
        **_constants(constants),
        "mean_error_deg": round(fmean(errors_deg.values()), 3),
        "errors_deg": errors_deg,
        "fitted": [str(path) for path in logs] if search.fit else [],
        "on_bound": {name: bound for name, (bound, _) in reached.items()},
        "out": out and str(out),
    }
    if robot is not None:
        after = _write_robot(robot, constants, logs)
        summary["robot_out"] = str(robot.out)
        summary["robot_errors_deg"] = {
            str(log.path): [
                round(robot_error_deg(config, log, constants), 3)
                for config in (robot.before, after)
            ]
            for log in recordings
        }
    if as_json:
        print(json.dumps(summary))
        return
    _print_constants(constants, reached)
    _print_errors(summary, robot)


def _constants(constants: ServoConstants) -> dict[str, Any]:
    rows = list(zip(CONSTANTS, constants.values, constants.low, constants.high, strict=True))
    return {
        "actuator": constants.actuator,
        "constants": {c.name: float(value) for c, value, _, _ in rows},
        "interval_95": {
            c.name: [float(low), float(high)] for c, _, low, high in rows if math.isfinite(low)
        },
    }


def _print_errors(summary: dict[str, Any], robot: RobotFile | None) -> None:
    for path, error in summary["errors_deg"].items():
        note = "" if path in summary["fitted"] else " (not fitted)"
        console.print(f"{path}: {error:.2f} degrees off on average{note}")
    console.print(f"mean {summary['mean_error_deg']:.2f} degrees")
    if robot is not None:
        before_deg, after_deg = (
            fmean(errors) for errors in zip(*summary["robot_errors_deg"].values(), strict=True)
        )
        console.print(
            f"{robot.out}: its simulated servo is {after_deg:.2f} degrees off on average, "
            f"that of {robot.before.name} {before_deg:.2f}",
            soft_wrap=True,
        )


def _check_one_servo(logs: Sequence[PendulumLog]) -> None:
    if len({log.actuator for log in logs}) > 1:
        names = ", ".join(sorted({log.actuator or "?" for log in logs}))
        raise InputError(f"the recordings are of several servos: {names}; give those of one")


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


def _write_robot(file: RobotFile, constants: ServoConstants, logs: list[Path]) -> RobotConfig:
    after = with_keys(robot_with(file.before, constants), {"name": file.out.stem}, str(file.out))
    write_result(file.out, plain_toml(after, robot_comment(constants, logs)))
    return after
