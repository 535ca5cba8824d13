"""Results of a camera check as findings, like those of the doctor."""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from snakewalk.config.camera import CameraConfig
from snakewalk.controller.cameras.camera_check import CameraReport
from snakewalk.controller.cameras.markers.floor_markers import FEWEST
from snakewalk.controller.cameras.overhead_camera import MISPLACED_M
from snakewalk.controller.console.finding import Finding

Lock = Literal["locked", "automatic", "not reported"]
_LEAST_RATE = 0.8  # of the requested rate
_GAP = 3.0  # periods of a frame
_LEAST_SEEN = 0.9  # of the pictures: a marker with less is unreliable
_SIDE = 0.05  # of a marker's side: more is a wrong print, or wrong places
_LIGHT = 0.03  # of the brightness: more is flicker, or automatic exposure
_LATENCY_TOLERANCE_S = 0.01  # largest error of latency_s
_MOVED_CAMERA_PX = 0.5


def camera_findings(
    report: CameraReport, camera: CameraConfig, locks: Mapping[str, Lock]
) -> list[Finding]:
    """Grade a report of a check against the camera's settings.

    ``locks`` are those of ``exposure`` and ``white balance``.
    """
    return [
        _frames(report, camera),
        *_markers(report, camera),
        *_bump(report),
        *(_lock(name, state) for name, state in locks.items()),
        _light(report),
        *_latency(report, camera),
    ]


def _frames(report: CameraReport, camera: CameraConfig) -> Finding:
    wide, high = report.size_px
    frames_text = (
        f"{report.frames} of {wide} x {high} pixels in {report.duration_s:.1f} s: "
        f"{report.rate_hz:.1f} a second, longest gap {1e3 * report.gap_max_s:.0f} ms"
    )
    if report.size_px != (camera.width_px, camera.height_px):
        asked = f"{camera.width_px} x {camera.height_px}"
        return Finding(
            "frames", "fail", frames_text, f"asked for are {asked} pixels: correct [camera]"
        )
    if not report.rate_hz >= _LEAST_RATE * camera.rate_hz:
        return Finding(
            "frames",
            "warn",
            frames_text,
            f"asked for are {camera.rate_hz:g} a second: less exposure time, another USB port",
        )
    if report.gap_max_s > _GAP / camera.rate_hz:
        return Finding(
            "frames", "warn", frames_text, "frames were lost: is the machine or USB busy?"
        )
    return Finding("frames", "ok", frames_text)


def _markers(report: CameraReport, camera: CameraConfig) -> list[Finding]:
    if not report.seen:
        extra = ", ".join(str(name) for name in report.others)
        extra_text = f"; in the picture are {extra}" if extra else ""
        remedy = "snakewalk pose markers, and their places in [camera.markers_m]"
        return [Finding("markers", "warn", f"none are named{extra_text}", remedy)]
    shown = ", ".join(f"{name} in {100.0 * share:.0f} %" for name, share in report.seen.items())
    rarely_seen = [name for name, share in report.seen.items() if share < _LEAST_SEEN]
    steady = len(report.seen) - len(rarely_seen)
    if steady >= len(report.seen):
        first = Finding("markers", "ok", f"all {steady} found in every picture, or nearly")
    else:
        lost = ", ".join(str(name) for name in rarely_seen)
        first = Finding(
            "markers",
            "warn" if steady >= FEWEST else "fail",
            f"found of the pictures: {shown}",
            f"marker {lost}: in view, lit, flat, white around it, at least 14 px wide?",
        )
    if report.floor is None:
        return [first, Finding("floor", "fail", report.fault, "four markers fix a floor")]
    floor = report.floor
    side = float(np.mean(list(floor.side_m.values())))
    markers_text = (
        f"markers lie {1e3 * floor.rms_m:.1f} mm (rms) from their places; their side is "
        f"{1e3 * side:.0f} mm"
    )
    if floor.lens_m is not None:
        x, y, z = floor.lens_m.tolist()
        markers_text += f"; the lens is {z:.2f} m above ({x:.2f}, {y:.2f})"
    worst = max(floor.residual_m, key=lambda name: floor.residual_m[name])
    if report.distortion is not None:
        error_mm = 1e3 * report.distortion.error_m
        second = Finding(
            "floor",
            "warn",
            f"{markers_text}; the lens distorts by up to {error_mm:.0f} mm",
            "calibrate the lens: snakewalk pose board, snakewalk pose lens",
        )
    elif floor.residual_m[worst] > MISPLACED_M:
        second = Finding(
            "floor", "fail", markers_text, f"measure the place of marker {worst} again"
        )
    elif abs(side / camera.marker_side_m - 1.0) > _SIDE:
        second = Finding(
            "floor",
            "warn",
            markers_text,
            f"marker_side_m is {1e3 * camera.marker_side_m:.0f} mm: was the print scaled, or are "
            "all places?",
        )
    else:
        second = Finding("floor", "ok", markers_text)
    return [first, second]


def _bump(report: CameraReport) -> list[Finding]:
    bump = report.bump
    if bump is None:
        return []
    if bump.undone and bump.away_px < _MOVED_CAMERA_PX and not bump.left_out:
        return [Finding("place", "ok", f"where it was, to {bump.away_px:.1f} px")]
    remedy = "photograph the empty floor again"
    return [Finding("place", "warn" if bump.undone else "fail", str(bump), remedy)]


def _lock(name: str, state: Lock) -> Finding:
    if state == "locked":
        return Finding(name, "ok", state)
    if state == "automatic":
        return Finding(name, "warn", state, "lock it, e.g. with v4l2-ctl: a robot changes it")
    return Finding(
        name, "warn", "the camera does not report whether it is locked", "see the light below"
    )


def _light(report: CameraReport) -> Finding:
    brightness_text = f"brightness varies by {100.0 * report.light_spread:.1f} %"
    if report.light_spread > _LIGHT:
        return Finding(
            "light", "warn", brightness_text, "lamps that flicker, or exposure that is not locked"
        )
    return Finding("light", "ok", brightness_text)


def _latency(report: CameraReport, camera: CameraConfig) -> list[Finding]:
    fit = report.latency
    if fit is None:
        return [
            Finding(
                "latency",
                "warn",
                "not measured",
                "with --port, a joint that is turned by hand, and a background in [camera]",
            )
        ]
    if fit.fault:
        return [Finding("latency", "warn", f"not measured: {fit.fault}")]
    latency_text = (
        f"{1e3 * fit.latency_s:.0f} ms, to {1e3 * max(fit.error_s, 1e-3):.0f} ms, from the joints' "
        f"motion (correlation {fit.correlation:.2f})"
    )
    if camera.device is not None and abs(fit.latency_s - camera.latency_s) > _LATENCY_TOLERANCE_S:
        remedy = f"[camera] latency_s = {max(fit.latency_s, 0.0):.3f}"
        return [Finding("latency", "warn", latency_text, remedy)]
    return [Finding("latency", "ok", latency_text)]
