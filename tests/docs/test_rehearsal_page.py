"""The commands of docs/start/rehearsal.md, as printed: a pty, UDP, a client, and the judge."""

import json
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.docs.test_commands_in_pages import ROOT, printed
from tests.helpers.command import snakewalk

PAGE = ROOT / "docs" / "start" / "rehearsal.md"

ENOUGH = 20
"""Poses that tell their noise within a half; the page's second brings 50 on an idle machine."""


def poses_of(check: list[str]) -> dict[str, Any]:
    """Repeat the command until the sender, which a busy machine delays, has sent enough."""
    for _ in range(30):
        found: dict[str, Any] = json.loads(snakewalk(*check, "--json").stdout)
        if found["poses"] >= ENOUGH:
            return found
    pytest.fail(f"few poses arrive: {found}")


@pytest.mark.slow
def test_the_page_works_as_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The motion is cut after a second: the body cannot have arrived, and nobody claims it."""
    monkeypatch.chdir(tmp_path)
    serve, check, run, judge = (shlex.split(line)[1:] for line in printed(PAGE)[:4])
    program = "import sys; from snakewalk.controller.cli.main import main; sys.exit(main())"
    with subprocess.Popen(
        [sys.executable, "-c", program, *serve], stdout=subprocess.PIPE, text=True
    ) as server:
        try:
            assert server.stdout is not None
            assert server.stdout.readline().startswith("port ")
            poses = poses_of(check)
            ran = snakewalk(*run, "--json", "--set", "run.time_limit_s=1")
        finally:
            server.send_signal(signal.SIGINT)
    assert poses["faults"] == [], poses
    assert poses["noise_m"] == pytest.approx(0.01, rel=0.5)
    answer = json.loads(ran.stdout)
    assert answer["pose_source"] == "udp", ran.stderr
    assert answer["poses_used"] > 0
    ended = snakewalk(*judge, "--json")
    found = json.loads(ended.stdout)
    assert ended.returncode == 1
    assert (found["waypoints"], found["truly_reached"], found["claimed"]) == (4, 0, 0)
    assert found["is_true"]
    assert found["pose_error_rms_m"] < 0.2
