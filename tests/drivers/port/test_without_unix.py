"""What runs offline where Python has no Unix modules: runs, exports, the stop button."""

import subprocess
import sys
from pathlib import Path

import pytest

ELSEWHERE = """
import os, sys
from pathlib import Path
import mcap.writer, mujoco, numba, rich, serial.tools.list_ports, typer  # these know their system

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name in {"termios", "fcntl", "grp", "pwd", "pty", "tty", "resource"}:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

for name in ("termios", "fcntl", "grp", "pwd", "pty", "tty", "resource"):
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Missing())
sys.platform = "elsewhere"
for name in ("getuid", "sched_setscheduler", "setpriority", "O_NOFOLLOW", "O_CLOEXEC"):
    delattr(os, name)
os.environ["USERNAME"] = "somebody"
from snakewalk.controller.cli.main import main
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.drivers.safety.stop_button import StopButton, stoppable_runs

def command(*words):
    sys.argv = ["snakewalk", *words]
    try:
        main()
    except SystemExit as ended:
        return ended.code
    return 0

with StopButton("mine") as button:
    (other,) = stoppable_runs()
    other.press("somebody")
    print(button.pressed())
    other.close()
print(list(stoppable_runs()))
run, table = sys.argv[1:]
run_robot(RunRequest(prepare_gait("lateral-undulation", seconds=0.2), Path(run)))
print("export", command("export", run + "/log.mcap", "--csv", table))
print("port", command("scan", "--port", "/dev/null"))
print("serve", command("bus", "serve"))
print("serial_fast_path" in str(list(sys.modules)))
"""


@pytest.mark.slow
def test_what_is_offline_needs_no_unix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    done = subprocess.run(
        [sys.executable, "-c", ELSEWHERE, str(tmp_path / "run"), str(tmp_path / "table")],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    told = done.stdout.splitlines()
    assert told[:2] == ["stop requested by somebody", "[]"], done.stderr
    assert {"export 0", "port 2", "serve 2"} <= set(told)
    assert told[-1] == "False"  # the loops that call Linux were never loaded
    assert "give the URL of a server that has one: socket://HOST:PORT" in done.stderr
    assert "bus serve: pseudo-terminals are for Linux and macOS" in done.stderr
    assert (tmp_path / "table" / "cycle.csv").exists()
