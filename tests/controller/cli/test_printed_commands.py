"""The commands that the pages print are run, in their order, in a folder a page.

They are run as printed, in this process, with a budget that the pages do not show (``budget``):

- a motion on simulated servos is cut ``MOTION_S`` after its ramp, and so is the motion on paper
  before, and that of ``plan`` with options; path, start-up, bus, log and summary are whole;
- a camera is looked through for a second;
- a film is made by ``log report`` only, and a page without pictures;
- of a study's runs the first one is made, in this process; of a graph's walks one; of actions the
  those of ``ACTIONS`` are recorded; a film of a crowd has two frames;
- ``bus serve`` looks at its port a few times;
- a command on one port finds the servos of its robot on a simulated line (``line_of``); ``--yes``
  answers its questions.

What a line takes from its reader, a film or a map, is a small one under the printed name. A line
that stood on an earlier page, and reads nothing of its own page, is not run again: its files are
put there. ``NOT_RUN`` names what is left out. README is
run always, docs/start by ``make slow``, the other pages by ``make nightly``.
"""

import re
import shlex
import shutil
from collections.abc import Callable, Sequence
from functools import cache
from glob import glob
from itertools import count, pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin

from snakewalk.config.loader import load_robot
from snakewalk.controller.animals.legged.animal_synthesis import read_animal
from snakewalk.controller.capture.capture import load_capture
from snakewalk.controller.capture.corrections import Corrections
from snakewalk.drivers.protocol.registers import baud_code
from snakewalk.sim.feetech.servos import FeetechServos
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import measured_gearbox
from snakewalk.sim.servo.protection import SupplyAndAmbient
from tests.controller.exchange.robot_import.test_robot_import import SWIMMER
from tests.docs.test_commands_in_pages import PAGES, ROOT, printed
from tests.helpers.command import snakewalk
from tests.helpers.in_process import work_in_this_process
from tests.helpers.line_port import OpenedFeetechLine, OpenedLine, line_port
from tests.oracles.rendered_snake import SnakeScene, film
from tests.oracles.tracked_animal import table

MOTION_S = 0.2
ACTIONS = {"forward-fast", "left-sharp", "right-sharp", "brake", "rest"}
LOOKS = 5
PENDULUM = "needs recordings of a pendulum: tests/controller/studies/identification"
PORTS = "needs several ports: tests/controller/bench/test_two_makes_service.py and others"
HANDS = "asks which joint moved: tests/controller/bench/test_chain_calibration.py"
SENDER = "needs a sender of poses or a camera: tests/controller/pose, tests/controller/cameras"
SEVERAL = "needs a film of several animals: tests/controller/capture/test_several_animals.py"
PLACES = "needs photographs of a place: tests/controller/mapping/mosaic/test_walkthrough_command.py"
PUBLISHED = "needs published keypoints: tests/controller/animals/fish/test_fish_command.py"
FOREIGN = "needs a file of another program: tests/foreign"
LISTENS = "listens until it is stopped: tests/controller/bench/test_bus_commands.py"
FOUND = "needs what calibrate finds on a bus: tests/controller/bench/test_chain_calibration.py"
SEARCH = "a search takes 18 whole runs at least: tests/controller/run/test_set.py"
EPISODES = "takes hundreds of episodes: tests/controller/learning"
NOT_RUN = {
    "bus calibrate": HANDS,
    "bus pendulum": PENDULUM,
    "pose calibrate": SENDER,
    "pose camera": SENDER,
    "bus sniff /dev/ttyUSB0": LISTENS,
    "stop": "would stop whatever runs on this machine: tests/controller/bench/test_stop.py",
    "--live": "needs keys of a terminal: tests/controller/run/test_gait_command.py",
    "--view": "serves a page until it is closed: tests/controller/view",
    "view": "serves a page until it is closed: tests/controller/view",
    "demo": "serves a page until it is closed: tests/controller/view/test_demo.py",
    "setup": "asks at a terminal: tests/controller/bench/test_setup.py",
    "ros": "holds a robot until it is stopped: tests/controller/ros",
    "--ros": "needs the extra ros and a graph: tests/controller/ros",
    "pose lens 0": "needs a camera: tests/controller/cameras/test_camera_command.py",
    "plan mine/run.toml --robot mine/found.toml": FOUND,
    "run mine/run.toml --robot mine/found.toml": FOUND,
    "log shadow": "needs four seconds of a run: tests/controller/studies/shadow/test_run_shadow.py",
    "--link": "would take a name that others may hold: tests/controller/bench/test_bus_commands.py",
    "animal fish synthesise": "needs a film of some beats: test_fish_command.py",
    "gait tune": SEARCH,
    "gait run mine.toml": SEARCH,
    "gait policy learn": EPISODES,
    "gait policy run mine.toml": EPISODES,
    "trials policy": "takes whole runs: tests/controller/studies/test_policy_trials.py",
    "animal capture dish.avi": SEVERAL,
    "animal track fish-1.npz": SEVERAL,
    "animal track fish.csv": SEVERAL,
    "animal body top.npz": "needs photographs: tests/controller/animals/mesh/test_photographs.py",
    "animal people run --mesh": "needs a person's mesh: tests/controller/animals/test_people.py",
    "animal fish match XMUC02_Trial1_sleap-1.csv": PUBLISHED,
    "animal body eel": PUBLISHED,
    "--tongue": "needs a table of a tongue: tests/controller/animals/synthesis/test_tongue.py",
    "world walkthrough": PLACES,
    "run ravine-run.toml": PLACES,
    "bus sniff exchange.jsonl --model": "needs an exchange with these servos: tests/sim/sniff",
    "gait repertoire play": "needs all actions: tests/controller/repertoire/test_schedule.py",
    "trials tasks": "makes whole runs: tests/controller/rehearsal/test_tasks.py",
    "play angles.csv": FOREIGN,
    "robot import snake.urdf -o snake.toml --assume": FOREIGN,
    "animal track markers.c3d": FOREIGN,
    "log report run/log.mcap.part": FOREIGN,
    "world from dem.tif --spacing 0.05": FOREIGN,
    "--virtual-time": "serves another process: tests/sim/serve/test_virtual_time.py",
    "--console": "needs keys of a terminal: tests/sim/serve/test_bus_commands.py",
    "--backend": "needs the extra warp: make warp",
    "--dask": "needs a cluster: tests/controller/studies/test_pool.py",
    "world stereo": "needs a calibrated pair: test_terrain_command.py",
    "--map": "looks through two cameras: tests/controller/run/test_stereo_head.py",
    "animal synthesise -o": "walks over all hills: test_synthesise_command.py",
    "robot identify": PENDULUM,
    "pose check": "needs a sender: tests/docs/test_rehearsal_page.py",
    "trials rehearse": "makes whole runs: tests/controller/rehearsal",
    "log judge": "needs a served run: tests/controller/rehearsal",
}
"""Command, or option, and why no line with it is run here."""

DEVICES = {"/dev/ttyUSB0", "/tmp/ttySnake", "./bus", "./tty"}
"""Ports of the pages that are replaced by a simulated line; ``why_not`` names the others."""
ON_A_PORT = (
    "doctor",
    *(
        f"bus {verb}"
        for verb in ("scan", "set", "inventory", "blink", "reboot", "backup", "restore")
    ),
)
"""Commands that use the only adapter if ``--port`` is left out."""
GRADED = 1
"""Exit code of ``doctor`` if it names a fault."""

LINES = [(page, line) for page in PAGES for line in printed(page)]


class Budget:
    """Whether a command plans to the end, and whether it cut a motion."""

    plans = False
    was_cut = False


@pytest.fixture
def budget(monkeypatch: pytest.MonkeyPatch) -> "Budget":
    """Make commands short; what is cut stands in this file's docstring."""
    from snakewalk.controller.bench.commands import bus_serve
    from snakewalk.controller.cameras import camera_watch
    from snakewalk.controller.console import pool
    from snakewalk.controller.repertoire import crowd_film, repertoire_recording
    from snakewalk.controller.report import artifacts
    from snakewalk.controller.run import run_robot
    from snakewalk.controller.run.kinds import walk_run
    from snakewalk.controller.studies import graph_study, trials

    now = Budget()
    drive, make, run_study = run_robot.Drive, artifacts.make_artifacts, graph_study.run_study

    def short_drive(**parts: Any) -> Any:
        now.was_cut = True
        plan = parts["plan"]
        run = plan.run.model_copy(update={"time_limit_s": MOTION_S})
        short = SimpleNamespace(run=run, robot=plan.robot, gain=plan.gain)
        return drive(**parts | {"plan": short})

    forecast = walk_run.forecast

    def short_forecast(*parts: Any, **options: Any) -> Any:
        now.was_cut = not now.plans
        return forecast(*parts, **options | ({} if now.plans else {"limit_s": MOTION_S}))

    def few_artifacts(record: Any, folder: Path, numbers: Any = None, **options: Any) -> Any:
        if numbers is None:  # of ``log report``
            return make(record, folder, numbers, **options)
        run_robot.write_summary(numbers, folder)
        return artifacts.Artifacts(None, None, ())

    each = pool.each

    def first_of(work: Any, items: Sequence[Any], **options: Any) -> Any:
        return each(work, items[:1], **options)

    work_in_this_process(monkeypatch)
    monkeypatch.setattr(run_robot, "Drive", short_drive)
    monkeypatch.setattr(walk_run, "forecast", short_forecast)
    monkeypatch.setattr(artifacts, "make_artifacts", few_artifacts)
    monkeypatch.setattr(
        artifacts, "_draw", lambda record, made="": artifacts.Drawings([], "", made)
    )
    for module in (pool, trials):
        monkeypatch.setattr(module, "each", first_of)
    monkeypatch.setattr(
        graph_study, "run_study", lambda spec, name, repeats, seed: run_study(spec, name, 1, seed)
    )
    record, crowd = repertoire_recording.record, crowd_film.film_crowd
    few = tuple(one for one in repertoire_recording.ACTIONS if one.name in ACTIONS)
    look = camera_watch.CameraWatch.check
    monkeypatch.setattr(
        camera_watch.CameraWatch, "check", lambda watch, _, *a: look(watch, 1.0, *a)
    )

    def short_film(*parts: Any, **options: Any) -> Any:
        return crowd(*parts, **options | {"seconds": 0.1})

    monkeypatch.setattr(repertoire_recording, "record", lambda *a, **b: record(*a, few, **b))
    monkeypatch.setattr(crowd_film, "film_crowd", short_film)

    def few_looks(*parts: Any) -> None:
        server, looks = parts[0], count()
        with Path(server.path).open("wb", buffering=0) as client:
            client.write(bytes.fromhex("FFFFFD00FE0300013142"))  # a ping to all
        server.serve(lambda: next(looks) > LOOKS)

    monkeypatch.setattr(bus_serve, "_run", few_looks)
    return now


def _ran(words: str) -> Callable[[Path], None]:
    """What a short command leaves under the name of its last option."""

    def make(to: Path) -> None:
        done = snakewalk(*words.split(), str(to))
        assert done.returncode in {0, 1}, done.stderr

    return make


def _log(words: str) -> Callable[[Path], None]:
    def make(to: Path) -> None:
        _ran(f"{words} --no-film --out")(to.parent)
        if to.name != "log.mcap":
            (to.parent / "log.mcap").rename(to)

    return make


def _run_folder(words: str) -> Callable[[Path], None]:
    return lambda to: _log(words)(to / "log.mcap")


def _scene(frames: int) -> SnakeScene:
    return SnakeScene(rows=160, columns=200, length_px=70.0, frames=frames, wave_hz=1.0)


def _film(to: Path) -> None:
    writer = cv2.VideoWriter(str(to), cv2.VideoWriter.fourcc(*"mp4v"), 30.0, (200, 160))
    for frame in film(_scene(24)):
        writer.write(cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR))
    writer.release()


def _frames(to: Path) -> None:
    to.mkdir()
    for k, frame in enumerate(film(_scene(12))):
        cv2.imwrite(str(to / f"{192 + k:05d}.png"), frame)


def _frame(to: Path) -> None:
    _frames(Path("frames"))
    shutil.copy("frames/00200.png", to)


def _midlines(to: Path) -> None:
    """Of a body that crawls along a sine."""
    lines = ["t,frame,point,x_m,y_m"]
    for frame in range(60):
        for point in range(30):
            x = 0.01 * (29 - point) + 0.006 * frame
            lines.append(
                f"{frame / 30:.4f},{frame},{point + 1},{x:.5f},{0.03 * np.sin(40 * x):.5f}"
            )
    to.write_text("\n".join(lines) + "\n")


def _fish(to: Path) -> None:
    """Both views of a fish whose every angle is known."""
    assert (
        snakewalk(
            "animal", "fish", "film", "tank", "--side", "--frames", "4", "--length-px", "60"
        ).returncode
        == 0
    )
    for view in ("top", "side"):
        pictures = [cv2.imread(str(one)) for one in sorted(Path("tank", view).glob("*.png"))]
        rows, columns = pictures[0].shape[:2]
        kind = cv2.VideoWriter.fourcc(*"mp4v")
        writer = cv2.VideoWriter(f"{view}.mp4", kind, 30.0, (columns, rows))
        for picture in pictures:
            writer.write(picture)
        writer.release()


@cache
def _track() -> bytes:
    """Captured once for all pages."""
    if not Path("film.mp4").exists():
        _film(Path("film.mp4"))
    _ran("animal capture film.mp4 -o")(Path("captured.npz"))
    return Path("captured.npz").read_bytes()


def _captured(to: Path) -> None:
    to.write_bytes(_track())


ROWS, COLUMNS = 90, 130
HILL_M = np.add.outer(0.4 * np.sin(np.arange(ROWS) / 15), 0.3 * np.cos(np.arange(COLUMNS) / 20))


def _elevation_model(to: Path) -> None:
    """A hill 500 times as large as the printed scale leaves it."""
    with rasterio.open(
        to, "w", driver="GTiff", height=ROWS, width=COLUMNS, count=1, dtype="float32",
        crs="EPSG:32632", transform=from_origin(500.0, 700.0, 30.0, 30.0),
    ) as out:  # fmt: skip
        out.write((500.0 * HILL_M).astype("float32"), 1)


def _point_cloud(to: Path) -> None:
    y, x = np.mgrid[70:160, 10:90]
    points = np.stack([x, y, 2.0 * np.sin(x / 15)], axis=-1).reshape(-1, 3)
    head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nHEIGHT 1\n"
    rows = "\n".join(" ".join(f"{value:.3f}" for value in row) for row in points)
    to.write_text(f"{head}WIDTH {len(points)}\nPOINTS {len(points)}\nDATA ascii\n{rows}\n")


def _heights(to: Path) -> None:
    cv2.imwrite(str(to), np.round(1000.0 * (HILL_M - HILL_M.min())).astype(np.uint16))


def _initial(name: str) -> Callable[[Path], None]:
    """One of the files that ``init`` makes, beside the others, which it names."""

    def make(to: Path) -> None:
        folder = to.parent / "initial"
        if not folder.exists():
            assert snakewalk("init", str(folder)).returncode == 0
        for file in folder.glob("*.toml"):
            shutil.copy(file, to.parent / file.name)
        shutil.copy(folder / name, to)

    return make


def _corrections(to: Path) -> None:
    """The head of a frame is at the other end."""
    held = load_capture(Path("track.npz"))
    said = Corrections(track=held.fingerprint, frames=len(held.captured.points_px), flipped=(3,))
    to.write_text(said.model_dump_json())


PLACEHOLDERS = {
    "VIDEO": "film.mp4",
    "FILM": "top.mp4",
    "LOG": "printed.mcap",
    "FILE": "midlines.csv",
    "RUN": "flat-slalom",
    "NAME": "yaw16",
}
"""What a reader puts in the place of a word in capitals."""

STAND_INS: dict[str, Callable[[Path], object]] = {
    "film.mp4": _film,
    "frames/": _frames,
    "frame.png": _frame,
    "midlines.csv": _midlines,
    "tracked.csv": lambda to: table(to, read_animal("lizard")),
    "track.npz": _captured,
    "worm.npz": _captured,
    "NAME.npz": lambda to: _ran("animal synthesise -o")(to.with_suffix("")),
    "top.mp4": _fish,
    "dem.tif": _elevation_model,
    "scan.pcd": _point_cloud,
    "heights.png": _heights,
    "my-run.toml": _initial("run.toml"),
    "my-robot.toml": _initial("robot.toml"),
    "mine.toml": _initial("robot.toml"),
    "my-xl430.toml": _initial("robot.toml"),
    "my-climb.toml": _initial("run.toml"),
    "found.toml": _initial("world.toml"),
    "faults.toml": lambda to: to.write_text('[[fault]]\nkind = "unplug"\nbehind = 8\nat_s = 5.0\n'),
    "long.avi": _film,
    "docs/validation.md": lambda to: to.parent.mkdir(),
    "mine.obj": _ran("animal body worm-like -o"),
    "snake.urdf": _ran("robot export yaw16 --urdf"),
    "track-corrections.json": _corrections,
    "docs/pictures/walks-fig9.png": lambda to: to.parent.mkdir(parents=True),
    "swimmer.xml": lambda to: to.write_bytes(SWIMMER.read_bytes()),
    "printed.mcap": _log("gait run sidewinding"),
    "runs/NAME": _run_folder("gait run sidewinding"),
    "runs/NAME/log.mcap": _log("gait run sidewinding"),
    "runs/flat-square-walk-seed0/log.mcap": _log("run flat-square"),
    "runs/jacksboro-traverse-walk-seed0": _run_folder("run jacksboro-traverse"),
}
"""By printed name, how a small one is made where no earlier line has left it."""


def commands_of(line: str) -> list[list[str]]:
    """The words of each command of a line, with a reader's in the place of capitals."""
    found: list[list[str]] = [[]]
    for word in shlex.split(line, comments=True):
        if word == "&&":
            found.append([])
        else:
            found[-1].append(PLACEHOLDERS.get(word, word))
    return [words[1:] for words in found]


def why_not(words: Sequence[str]) -> str | None:
    """Why a command is not run here."""
    text = " ".join(words)
    if "/dev/ttyUSB1" in text:
        return PORTS
    if "--port" in words and words[words.index("--port") + 1] not in DEVICES:
        return PORTS
    if "--pose" in words and "--port" in words:
        return SENDER
    for name, reason in NOT_RUN.items():
        if name in words if name.startswith("-") else f"{text} ".startswith(f"{name} "):
            return reason
    return None


def _put_what_it_reads(words: Sequence[str], page: Path) -> None:
    given = [word for before, word in pairwise(words) if before not in {"-o", "--out", "--record"}]
    for word in given:
        if Path(word).exists():
            continue
        if word in STAND_INS:
            STAND_INS[word](Path(word))
        elif word.endswith(".toml"):
            blocks = re.findall(r"^```toml\n(.*?)^```", page.read_text("utf-8"), re.M | re.S)
            if len(blocks) == 1:
                Path(word).write_text(blocks[0], "utf-8")


def line_of(words: Sequence[str], page: Path) -> OpenedLine | OpenedFeetechLine:
    """Return a line with the servos of the robot that a command or its page names."""
    name = "sts3215-12" if page.stem == "feetech" else "yaw16"
    if "my-run.toml" in words:
        name = "printed12"
    robot = load_robot(words[words.index("--robot") + 1] if "--robot" in words else name)
    baud = int(words[words.index("--baud") + 1]) if "--baud" in words else robot.servo.baud
    ids, records = robot.servo_ids, robot.servo_records
    if words[:2] == ["bus", "set"]:  # the reader has unplugged the others
        ids, records = (int(words[words.index("--id") + 1]),), records[:1]
    gears = [measured_gearbox(facts) for facts in records]
    plant = BenchPlant(len(records), gear=gears)
    if records[0].is_feetech:
        servos = FeetechServos(ids, plant, records[0], robot.servo.supply_v)
        for row in range(len(servos)):
            servos["Baud Rate"][row] = baud_code(records[0], baud)
            servos.registers.store(row, "Baud Rate")
        return OpenedFeetechLine(servos, None, baud)
    bank = ServoBank(ids, records, baud)
    bank["Return Delay Time"][:] = 0
    around = SupplyAndAmbient(supply_v=robot.servo.supply_v)
    return OpenedLine(bank, plant, supply_and_ambient=around)


def _run_on_a_line(words: Sequence[str], page: Path) -> str | None:
    """Run a command on a simulated line; return what is wrong."""
    with line_port(line_of(words, page)) as device:
        given = [device if word in DEVICES else word for word in words]
        if "--port" not in words:
            given += ["--port", device]
        if words[1] in {"set", "reboot", "restore"} and "--dry-run" not in words:
            given.append("--yes")
        done = snakewalk(*given)
    most = GRADED if words[0] == "doctor" or "run" in words else 0
    return None if done.returncode <= most else f"{shlex.join(words)}: {done.stderr}{done.stdout}"


def _files() -> set[str]:
    return {str(path) for path in Path().rglob("*") if path.is_file()}


def _run(words: Sequence[str], budget: Budget, left: dict[str, Path]) -> str | None:
    """Run a command, or put the files there that it left before; return what is wrong."""
    name = shlex.join(words)
    if name in left:
        shutil.copytree(left[name], ".", dirs_exist_ok=True)
        return None
    reads = any(Path(word).exists() for word in words)
    before = _files()
    budget.plans, budget.was_cut = name == "plan", False
    done = snakewalk(*words)
    if done.returncode not in ({0, 1} if budget.was_cut else {0}):
        return f"{name}: {done.stderr}"
    if not reads:
        left[name] = Path.cwd().parent / f"left{len(left)}"
        for file in _files() - before:
            to = left[name] / file
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, to)
        left[name].mkdir(exist_ok=True)
    return None


def _parameter(page: Path) -> Any:
    name = str(page.relative_to(ROOT))
    if name == "README.md":
        return pytest.param(page, id=name)
    if page.parent.name == "start":
        marks = pytest.mark.slow
    else:
        marks = pytest.mark.nightly("runs the commands of every page, with films and sweeps")
    return pytest.param(page, id=name, marks=marks)


RUN_PAGES = [
    _parameter(page) for page in PAGES if printed(page) and not page.name.startswith("add-")
]
"""All of them need more than a minute. Pages that add something to
snakewalk have tests of their own in ``tests/docs``."""


@pytest.fixture(scope="session")
def left() -> dict[str, Path]:
    """Folders of what each command left that read nothing of its page."""
    return {}


@pytest.mark.parametrize("page", RUN_PAGES)
def test_the_commands_of_a_page_run(
    page: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    budget: Budget,
    left: dict[str, Path],
) -> None:
    monkeypatch.chdir(tmp_path)
    wrong = []
    for line in printed(page):
        for words in commands_of(line):
            if why_not(words) is not None:
                continue
            _put_what_it_reads(words, page)
            if "--port" in words or shlex.join(words[:2]).startswith(ON_A_PORT):
                wrong.append(_run_on_a_line(words, page))
                continue
            paths = [path for word in words for path in sorted(glob(word)) or [word]]
            wrong.append(_run(paths, budget, left))
    assert [one for one in wrong if one is not None] == []


def test_what_is_not_run_is_printed_somewhere() -> None:
    """Else its reason is out of date."""
    every = [words for page in PAGES for line in printed(page) for words in commands_of(line)]
    reasons = {why_not(words) for words in every}
    assert set(NOT_RUN.values()) <= reasons
    assert sum(why_not(words) is None for words in every) > 150
