"""A package of another author adds plug-ins, which the command line finds and uses."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from snakewalk.controller.console import plugins
from tests.helpers.command import snakewalk

MANIFEST = """
PLUGINS = (
    ("motion", "zigzag", "A wave for a second.", "demo_snake.things:zigzag"),
    ("run", "demo-gait", "A gait as a kind of run.", "demo_snake.things:demo_gait"),
    ("pose", "demo-pose", "The simulator, by another name.", "demo_snake.things:DemoPose"),
    ("map", "demo-map", "A map of nothing.", "demo_snake.things:DemoMap"),
    ("observer", "count", "Count the rows of a run.", "demo_snake.things:count"),
    ("look", "demo-look", "A look that cannot be made.", "demo_snake.things:DemoLook"),
    ("motion", "broken", "Its module does not import.", "demo_snake.absent:broken"),
    ("command", "hello", "Say hello.", "demo_snake.things:hello", "The job"),
)
"""
THINGS = '''
import contextlib
from pathlib import Path

from snakewalk import GaitMotion, InputError, make_gait, prepare_gait
from snakewalk.controller.console.command import command
from snakewalk.controller.run.pose_provider import SimulatorPose
from snakewalk.controller.runlog.evidence import Kind, PoseEvidence


def zigzag(robot):
    gait = make_gait("lateral-undulation")
    return GaitMotion(gait, robot, duration_s=1.0)


def demo_gait(run, robot, world):
    made = prepare_gait("lateral-undulation", robot="yaw16", seconds=1.0)
    return made


class DemoPose(SimulatorPose):
    def evidence(self, run, robot):
        return PoseEvidence(Kind.MEASURED, "demo-pose")


class DemoMap:
    def faults(self, prepared, *, on_port):
        return ["the demo map knows nothing"]


class DemoLook:
    def check(self, look):
        raise InputError(f"{look}: the demo look cannot be made")

    def make(self, look, header):
        raise NotImplementedError


class Counter:
    def __init__(self, file):
        self.file, self.rows = file, 0

    def on_row(self, topic, row):
        self.rows += 1

    def on_picture(self, image, time_s):
        pass

    def on_button(self, path):
        pass


@contextlib.contextmanager
def count(argument):
    counter = Counter(Path(argument))
    yield counter
    counter.file.write_text(str(counter.rows))


@command("hello", examples=("hello",))
def hello() -> None:
    """Say hello."""
    print("hello from another package")
'''
RUN = """
name = "short"
robot = "yaw16"
world = "flat"
motion = "serpenoid"
waypoints_m = [[0.5, 0.0]]
time_limit_s = 4.0
"""


def install(folder: Path, manifest: str = MANIFEST) -> None:
    """Put a package and its metadata into a folder, as an installer does."""
    package, info = folder / "demo_snake", folder / "demo_snake-1.0.dist-info"
    package.mkdir()
    info.mkdir()
    (package / "__init__.py").write_text("")
    (package / "manifest.py").write_text(manifest)
    (package / "things.py").write_text(THINGS)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: demo-snake\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[snakewalk.plugins]\ndemo = demo_snake.manifest\n")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    place = tmp_path / "site"
    place.mkdir()
    monkeypatch.syspath_prepend(place)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.toml").write_text(RUN)
    plugins.foreign_plugins.cache_clear()
    yield place
    plugins.foreign_plugins.cache_clear()
    for name in [name for name in sys.modules if name.startswith("demo_snake")]:
        del sys.modules[name]


def test_the_list_shows_each_plug_in_with_its_package(folder: Path) -> None:
    install(folder)
    shown = snakewalk("list").stdout
    for name in ("motion zigzag", "run demo-gait", "pose demo-pose", "observer count"):
        assert [line for line in shown.splitlines() if name in line and "demo-snake" in line], name
    assert "pose camera" in shown


def test_a_command_is_listed_and_runs(folder: Path) -> None:
    install(folder)
    assert "Say hello." in snakewalk("--help").stdout
    assert snakewalk("hello").stdout == "hello from another package\n"


@pytest.mark.slow
@pytest.mark.parametrize("motion", ["zigzag", "demo-gait"])
def test_a_motion_and_a_kind_of_run_run(folder: Path, motion: str) -> None:
    pytest.importorskip("mujoco")
    install(folder)
    done = snakewalk("run", "short.toml", "--motion", motion, "--no-film", "--json", "-o", "out")
    assert json.loads(done.stdout)["tripped"] is None, done.stderr
    assert Path("out/log.mcap").exists()


@pytest.mark.slow
def test_a_pose_source_and_an_observer_are_used(folder: Path) -> None:
    pytest.importorskip("mujoco")
    install(folder)
    done = snakewalk(
        *("run", "short.toml", "--pose", "demo-pose", "--observe", "count:rows.txt"),
        *("--no-film", "--json", "-o", "out"),
    )
    assert json.loads(done.stdout)["pose_source"] == "demo-pose", done.stderr
    assert int(Path("rows.txt").read_text()) > 100


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--map", "demo-map"), "the demo map knows nothing"),
        (("--look", "demo-look"), "demo-look: the demo look cannot be made"),
        (("--motion", "zigzg"), "did you mean zigzag?"),
        (("--motion", "broken"), "motion broken of demo-snake: cannot be imported"),
        (("--observe", "nobody"), "--observe nobody: unknown"),
        (("--observe", "page"), "use --view"),
    ],
)
def test_what_cannot_be_is_one_line(folder: Path, words: tuple[str, ...], said: str) -> None:
    pytest.importorskip("mujoco")
    install(folder)
    film = () if "--look" in words else ("--no-film",)
    done = snakewalk("run", "short.toml", *words, *film, "-o", "out")
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_broken_manifest_is_one_warning(folder: Path) -> None:
    install(folder, "PLUGINS = 1 / 0")
    done = snakewalk("list")
    assert done.returncode == 0
    assert done.stderr.count("plug-ins of demo-snake: ignored") == 1
