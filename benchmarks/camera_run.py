"""The command of a run by the overhead camera, and of the same run by the simulator's truth.

CPU time from start to end: rendering, tracking, reckoning, the log and its report are all in it.
"""

import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.rows import Row
from snakewalk.config.camera import CameraConfig, PoseName

TITLE = "snakewalk run flat-square --no-film, by the simulator's truth and with --pose camera"

MOST_TIMES = 3.0


def run() -> list[Row]:
    """Measure."""
    plain_s, _ = _run("simulator")
    camera_s, duration_s = _run("camera")
    frames = duration_s * CameraConfig().rate_hz
    return [
        Row("without a camera", plain_s, "s"),
        Row("with --pose camera", camera_s, "s", "3 times that without", camera_s / plain_s,
            MOST_TIMES),
        Row("a frame, drawn and tracked", 1e3 * (camera_s - plain_s) / frames, "ms"),
    ]  # fmt: skip


def _run(pose: PoseName) -> tuple[float, float]:
    """CPU time and simulated time, s."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        before_s = _children_s()
        subprocess.run(
            [Path(sys.executable).with_name("snakewalk"), "run", "flat-square", "--pose", pose,
             "--no-film", "--out", out],
            check=True,
            capture_output=True,
        )  # fmt: skip
        summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
        return _children_s() - before_s, float(summary["duration_s"])


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
