"""``snakewalk pose camera``: whether the overhead camera sees everything that a run needs."""

from contextlib import ExitStack
from math import isnan
from typing import Annotated

import typer

from snakewalk.controller.cameras.camera_findings import camera_findings
from snakewalk.controller.cameras.camera_watch import CameraWatch, show_nothing
from snakewalk.controller.console.command import command
from snakewalk.controller.console.findings_table import show_findings
from snakewalk.controller.console.options import (
    VIEW_AT,
    Json,
    RunName,
    RunPort,
    Set,
    ViewAt,
    key_values,
)
from snakewalk.controller.run.factory import changed, prepare_job
from snakewalk.controller.run.pose_provider import pose_faults


@command(
    "pose camera",
    examples=("pose camera flat-square", "pose camera my-run.toml --port /dev/ttyUSB0 --view"),
)
def check(
    run: RunName = "flat-square",
    port: RunPort = None,
    device: Annotated[
        str | None, typer.Option(help="camera: a number, a device, an address or a film")
    ] = None,
    seconds: Annotated[
        float, typer.Option(min=1.0, max=36_000.0, help="duration of the check in seconds")
    ] = 8.0,
    set_: Set = None,
    view: Annotated[
        bool, typer.Option("--view", help="show the picture in a browser during the check")
    ] = False,
    view_at: ViewAt = VIEW_AT,
    as_json: Json = False,
) -> None:
    """Check a camera, real or simulated: markers, frame rate, latency, light.

    With --port the command reads the joints and never moves them. Turn one joint by hand,
    unevenly, to measure the latency.
    """
    prepared = prepare_job(run, keys=key_values("--set", set_))
    if device is not None:
        camera = prepared.run.camera.model_copy(update={"device": device})
        prepared = changed(prepared, run=prepared.run.model_copy(update={"camera": camera}))
    watch = CameraWatch(prepared, port)
    if watch.name == "simulated":
        job = prepared.run.model_copy(update={"pose": "camera"})
        pose_faults(job, prepared.robot, prepared.world, metal=False)
    with ExitStack() as stack:
        on_frame = show_nothing
        if view:
            from snakewalk.controller.cameras.camera_page import open_camera_page  # noqa: PLC0415  --view: an extra

            page = stack.enter_context(open_camera_page(view_at, prepared.run.camera, watch))
            on_frame = page.on_frame
        camera_check = watch.check(seconds, on_frame)
    report = camera_check.report()
    findings = camera_findings(report, prepared.run.camera, watch.locks)
    fit = report.latency
    measured = fit is not None and not fit.fault
    show_findings(
        findings,
        {
            "camera": watch.name,
            "frames": report.frames,
            "frame_rate_hz": None if isnan(report.rate_hz) else round(report.rate_hz, 2),
            "markers_found": {str(name): round(share, 3) for name, share in report.seen.items()},
            "residual_mm": None if report.floor is None else round(1e3 * report.floor.rms_m, 2),
            "moved_px": None if report.bump is None else round(report.bump.away_px, 2),
            "latency_ms": round(1e3 * fit.latency_s, 1) if fit is not None and measured else None,
            "latency_error_ms": round(1e3 * fit.error_s, 1) if fit and measured else None,
            "exposure": watch.locks["exposure"],
            "white_balance": watch.locks["white balance"],
            "light_spread": round(report.light_spread, 4),
        },
        as_json,
    )
