"""``snakewalk identify``: constants of a servo from recordings of it."""

import json
import math
from pathlib import Path
from statistics import fmean
from typing import Annotated

import typer
from rich.table import Table

from snakewalk.config.errors import InputError
from snakewalk.controller.app.cli.options import Force, Json, console
from snakewalk.controller.app.result_files import atomic_write, refuse_to_overwrite


def identify(
    logs: Annotated[
        list[Path], typer.Argument(help="recordings of one servo with a pendulum (BAM's raw JSON)")
    ],
    judge: Annotated[
        list[Path] | None, typer.Option(help="a recording only to be judged on; again for more")
    ] = None,
    start: Annotated[
        Path | None, typer.Option(help="constants to begin with, as BAM writes them")
    ] = None,
    fit: Annotated[
        bool, typer.Option("--fit/--no-fit", help="fit, or only judge the constants of --start")
    ] = True,
    seed: Annotated[int, typer.Option(min=0, help="of the search")] = 0,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="write the constants here, as BAM's JSON")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Find a servo's resistance, torque constant, friction, inertia and P unit, with intervals."""
    from snakewalk.controller.app.identification.pendulum_fit import (  # noqa: PLC0415  heavy; --help stays quick
        error_deg,
        fit_pendulum,
    )
    from snakewalk.controller.app.identification.pendulum_log import read_pendulum_log  # noqa: PLC0415
    from snakewalk.controller.app.identification.servo_constants import (  # noqa: PLC0415
        CONSTANTS,
        bam_text,
        read_bam,
    )
    from snakewalk.controller.app.progress import ProgressBar  # noqa: PLC0415

    if not fit and start is None:
        raise InputError("--no-fit judges constants: give them with --start FILE")
    refuse_to_overwrite([out], force)
    fitted = [read_pendulum_log(path) for path in logs]
    judged = [read_pendulum_log(path) for path in judge or []]
    found = None if start is None else read_bam(start)
    if len({log.actuator for log in (*fitted, *judged)}) > 1:
        names = ", ".join(sorted({log.actuator or "?" for log in (*fitted, *judged)}))
        raise InputError(f"the recordings are of several servos: {names}; give those of one")
    if fit or found is None:
        with ProgressBar("fits", transient=True) as bar:
            found = fit_pendulum(fitted, found, seed=seed, on_progress=bar.update)
    if out is not None:
        with atomic_write(out) as part:
            part.write_text(bam_text(found), encoding="utf-8")
    errors = {
        str(log.path): (round(error_deg(found, log), 3), fit and k < len(fitted))
        for k, log in enumerate((*fitted, *judged))
    }
    mean_deg = round(fmean(error for error, _ in errors.values()), 3)
    rows = list(zip(CONSTANTS, found.values, found.low, found.high, strict=True))
    if as_json:
        result = {
            "actuator": found.actuator,
            "constants": {c.name: float(value) for c, value, _, _ in rows},
            "interval_95": {
                c.name: [float(low), float(high)] for c, _, low, high in rows if math.isfinite(low)
            },
            "mean_error_deg": mean_deg,
            "errors_deg": {path: error for path, (error, _) in errors.items()},
            "fitted": [path for path, (_, used) in errors.items() if used],
            "out": out and str(out),
        }
        print(json.dumps(result))
        return
    table = Table("constant", "value", "95 % interval", box=None)
    for constant, value, low, high in rows:
        interval = f"{low:.4g} to {high:.4g}" if math.isfinite(low) else "-"
        table.add_row(constant.name.replace("_", " "), f"{value:.4g}", interval)
    console.print(table)
    for path, (error, used) in errors.items():
        console.print(
            f"{path}: {error:.2f} degrees off on average{'' if used else ' (not fitted)'}"
        )
    console.print(f"mean {mean_deg:.2f} degrees")
