"""``snakewalk gait fit``: joint angles that lay the robot on a curve in space."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from snakewalk.config.archive import why_no_file
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.config.text_table import numbers_of, read_rows
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, Robot, show
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_ending,
    check_picture,
)
from snakewalk.controller.gaits.backbone import fit_backbone

COLUMNS = ("x_m", "y_m", "z_m")


@command(
    "gait fit",
    examples=("gait fit CURVE.csv --picture fit.png", "gait fit CURVE.csv -o joints.npz"),
    results=("output", "picture"),
)
def fit_gait(
    curve: Annotated[
        Path, typer.Argument(help="curve, head first: a table with the columns x_m, y_m, z_m")
    ],
    robot: Robot = None,
    picture: Annotated[
        Path | None, typer.Option(help="draw curve and chain here (.png, .svg, .pdf)")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="write joint angles and positions here (.npz)"),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Fit the robot to a curve in space: joint angles, and distance of the joints from it."""
    check_picture(picture)
    check_ending(output, "a file of joint angles", ".npz")
    body = load_robot(robot or "alternating16")
    points_m = _read(curve)
    try:
        fit = fit_backbone(body, points_m)
    except InputError as error:
        raise InputError([f"{curve}: {line}" for line in error.faults]) from None
    if output is not None:
        with atomic_write(output) as part:
            np.savez(
                part,
                joint_rad=fit.joint_rad,
                head_m=fit.head_m,
                head_rotation=fit.head_rotation,
                points_m=fit.points_m,
                distance_m=fit.distance_m,
                robot=np.array(body.name),
            )
    if picture is not None:
        from snakewalk.controller.figures.backbone import draw_fit  # noqa: PLC0415  --picture: an extra

        draw_fit(fit, points_m, body.name, picture)
    limit = np.array(body.limit_rad)
    facts: dict[str, object] = {
        "curve": str(curve),
        "robot": body.name,
        "residual_m": round(fit.residual_m, 6),
        "mean_distance_m": round(float(fit.distance_m.mean()), 6),
        "joints_at_limit": int(np.count_nonzero(np.abs(fit.joint_rad) >= limit - 1e-9)),
        "joint_rad": [round(float(angle), 5) for angle in fit.joint_rad],
    }
    if output is not None:
        facts["output"] = str(output)
    if picture is not None:
        facts["picture"] = str(picture)
    if not as_json:
        facts["joint_rad"] = " ".join(f"{angle:.3f}" for angle in fit.joint_rad)
    show(facts, as_json)


def _read(path: Path) -> list[list[float]]:
    if not path.is_file():
        raise InputError(why_no_file(path))
    first, *rows = read_rows(path, "table") or [[]]
    names = [name.strip() for name in first]
    if missing := [name for name in COLUMNS if name not in names]:
        raise InputError(
            f"{path}: no column {', '.join(missing)}; the first line names the columns "
            f"{', '.join(COLUMNS)}, the points follow from the head backwards"
        )
    lines = [line for line, row in enumerate(rows, start=2) if any(row)]
    table = numbers_of(path, filter(any, rows), names, lines)
    points = table[:, [names.index(name) for name in COLUMNS]]
    for line in np.array(lines)[~np.isfinite(points).all(axis=1)]:
        raise InputError(f"{path}: line {line} lacks one of {', '.join(COLUMNS)}; fill it in")
    listed: list[list[float]] = points.tolist()
    return listed
