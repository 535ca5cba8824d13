"""No command executes a Python file of the working folder, in itself or in a child process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mujoco")

from snakewalk.controller.console.child_process import child_environ, run_code
from snakewalk.controller.console.imports import make_path_safe

ROOT = Path(__file__).parents[3]
PROGRAM = (
    "from snakewalk.controller.cli.main import main\n\nif __name__ == '__main__':\n    main()\n"
)
PACKAGES = (
    "numpy", "scipy", "numba", "llvmlite", "mujoco", "pydantic", "typer", "rich", "mcap", "serial",
    "networkx", "viser", "websockets", "rclpy", "yaml", "cv2", "av", "matplotlib", "distributed",
    "cma", "gymnasium", "config", "controller", "drivers", "sim", "sitecustomize", "usercustomize",
)  # fmt: skip
SHADOW = """
import os
with open({mark!r}, "a", encoding="utf-8") as file:
    file.write(f"{{__name__}} in {{os.getpid()}}\\n")
raise SystemExit(77)
"""
CAPSULE = '<geom type="capsule" size="0.02" fromto="0 0 0 -0.1 0 0"/>'
LINK = f'<body pos="-0.1 0 0"><joint axis="0 0 1" range="-1 1" limited="true"/>{CAPSULE}'
MODEL = f"""<mujoco><compiler angle="radian"/><worldbody><body pos="0 0 0.1"><freejoint/>{CAPSULE}
{LINK}{LINK}</body></body></body></worldbody></mujoco>"""
GAIT = "lateral-undulation"
SHORT = ("--seconds", "5", "--seeds", "1", "--workers", "1")
PAGE = ("--view", "--view-at", "127.0.0.1:0")
SLOW = pytest.mark.slow
NIGHTLY = pytest.mark.nightly("runs in processes that all import planted files: 75 s of CPU")
COMMANDS = [
    pytest.param(("robot", "import", "model.xml", "-o", "robot.toml"), id="import"),
    pytest.param(
        ("gait", "run", GAIT, "--seconds", "0.1", "--no-film", *PAGE), id="page", marks=NIGHTLY
    ),
    pytest.param(("trials", "run", GAIT, *SHORT), id="trials", marks=SLOW),
    pytest.param(
        ("gait", "sweep", GAIT, "--robot", "yaw16", "--points", "1"), id="sweep", marks=NIGHTLY
    ),
    pytest.param(
        ("gait", "tune", GAIT, "--budget", "16", "--seeds", "1"), id="tune", marks=NIGHTLY
    ),
    pytest.param(("trials", "policy", GAIT, *SHORT), id="policy-trials", marks=NIGHTLY),
    pytest.param(
        ("gait", "policy", "learn", "-o", "p.toml", "--generations", "1", "--steps", "50"),
        id="policy-learn",
        marks=NIGHTLY,
    ),
]


class Folder:
    """A working folder in which a file hides every module of Python and of its packages."""

    def __init__(self, path: Path) -> None:
        self.path = path / "work"
        self.path.mkdir()
        self._mark = path / "executed"
        text = SHADOW.format(mark=str(self._mark))
        for name in {*sys.stdlib_module_names, *PACKAGES}:
            (self.path / f"{name}.py").write_text(text)
        (self.path / "model.xml").write_text(MODEL)
        (path / "bin").mkdir()
        self.script = path / "bin" / "snakewalk"
        self.script.write_text(PROGRAM)

    @property
    def executed(self) -> str:
        return self._mark.read_text() if self._mark.exists() else ""

    def run(self, *words: str | Path) -> "subprocess.CompletedProcess[str]":
        path = os.pathsep.join(entry for entry in sys.path if entry)
        return subprocess.run(
            [sys.executable, *words],
            cwd=self.path,
            env=os.environ | {"PYTHONPATH": path, "XDG_RUNTIME_DIR": str(self.path.parent)},
            capture_output=True,
            text=True,
            check=False,
        )


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    return Folder(tmp_path)


@pytest.mark.costs("starts a program in a folder of planted files")
@pytest.mark.parametrize("words", COMMANDS)
def test_a_command_executes_no_file_of_the_working_folder(
    folder: Folder, words: tuple[str, ...]
) -> None:
    if "--view" in words:
        pytest.importorskip("viser")
    if "learn" in words:
        pytest.importorskip("cma")
    ended = folder.run(folder.script, *words)
    assert folder.executed == ""
    assert ended.returncode == 0, ended.stderr


@pytest.mark.nightly("a whole run that imports planted files: 11 s of CPU")
def test_the_ros_node_executes_no_file_of_the_working_folder(folder: Folder) -> None:
    pytest.importorskip("rclpy")
    ended = folder.run(folder.script, "ros", "--seconds", "0.1", "--out", "run")
    assert folder.executed == ""
    assert ended.returncode == 0, ended.stderr


@pytest.mark.nightly("a run, its shadow and an identification: 60 s of CPU")
def test_studies_of_logs_execute_no_file_of_the_working_folder(folder: Folder) -> None:
    words = ["lateral-undulation", "--seconds", "6", "--no-film", "--out", "run"]
    assert folder.run(folder.script, "gait", "run", *words).returncode == 0
    log = "run/log.mcap"
    for command in (("log", "shadow", log), ("robot", "identify", log)):
        ended = folder.run(folder.script, *command)
        assert folder.executed == ""
        assert ended.returncode in {0, 1}, ended.stderr


@pytest.mark.nightly("a process that imports planted files: 6 s of CPU")
def test_the_drawing_of_a_served_bus_executes_no_file_of_the_working_folder(
    folder: Folder,
) -> None:
    code = (
        "import os, sys; os.chdir(sys.argv[1])\n"
        "from snakewalk.controller.bench.live_table import LiveScreen, Snapshot\n"
        "from snakewalk.sim.sniff.decode import Decoder\n"
        "if __name__ == '__main__':\n"
        "    with LiveScreen(Decoder) as screen:\n"
        "        while not screen.ready: pass\n"
        "        screen.show(Snapshot('drawn', [], ()))\n"
        "        while not screen.ready: pass\n"
    )
    (folder.script.parent / "draw.py").write_text(code)
    ended = folder.run(folder.script.parent / "draw.py", folder.path)
    assert folder.executed == ""
    assert "drawn" in ended.stderr


@pytest.mark.slow
def test_the_main_process_drops_the_working_folder(folder: Folder) -> None:
    """``python -c`` puts it first; what is imported before the command runs is Python's matter."""
    code = (
        "import sys; here = sys.path.pop(0); from snakewalk.controller.cli.main import main\n"
        "sys.path.insert(0, here); main()"
    )
    ended = folder.run("-c", code, "gait", "show", "lateral-undulation")
    assert folder.executed == ""
    assert ended.returncode == 0, ended.stderr


def test_a_clone_that_is_the_working_folder_stays_importable_after_everything_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(sys, "path", ["", str(ROOT), "/elsewhere"])
    monkeypatch.delenv("PYTHONPATH", raising=False)
    make_path_safe()
    assert sys.path == ["/elsewhere", str(ROOT)]


def test_a_folder_that_pythonpath_names_stays_and_an_empty_entry_does_not(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    named = os.pathsep.join(["", str(tmp_path), "/opt/ros"])
    monkeypatch.setenv("PYTHONPATH", named)
    monkeypatch.setattr(sys, "path", [str(tmp_path), "/opt/ros", str(ROOT)])
    make_path_safe()
    assert sys.path == [str(tmp_path), "/opt/ros", str(ROOT)]
    assert child_environ()["PYTHONPATH"] == os.pathsep.join([str(tmp_path), "/opt/ros"])
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["/opt/ros", ""]))
    make_path_safe()
    assert sys.path == ["/opt/ros", str(ROOT)]
    assert child_environ()["PYTHONPATH"] == "/opt/ros"
    monkeypatch.setenv("PYTHONPATH", os.pathsep)
    assert "PYTHONPATH" not in child_environ()


def test_starting_a_child_leaves_the_environment_as_it_was(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("PYTHONPATH", f"/opt/ros{os.pathsep}")
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    before = dict(os.environ)
    assert (
        run_code("import sys; print(sys.flags.safe_path, '' in sys.path)").stdout == "True False\n"
    )
    from snakewalk.controller.console.pool import process_pool

    with process_pool(1) as pool:
        assert pool.submit(os.getenv, "PYTHONSAFEPATH").result() == "1"
    assert dict(os.environ) == before


@pytest.mark.slow
def test_numba_takes_no_cache_from_a_file_of_the_working_folder(tmp_path: Path) -> None:
    pytest.importorskip("yaml")
    (tmp_path / ".numba_config.yaml").write_text("cache_dir: /nowhere\n")
    code = (
        "import os, sys; from snakewalk.controller.cli import main\n"
        "sys.argv = ['snakewalk', '--version']\n"
        "try: main.main()\n"
        "except SystemExit: pass\n"
        "import numba.core.config; print(repr(numba.core.config.CACHE_DIR))"
    )
    env = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    path = os.pathsep.join(entry for entry in sys.path if entry)
    said = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path, env=env | {"PYTHONPATH": path}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert said.stdout.splitlines()[-1] == "''"
