"""What a wheel installs, in an environment of its own, beside a user's project.

The user's project has packages ``config``, ``drivers``, ``sim`` and ``controller`` of its own, as
many projects do. They stay the user's, and the pytest plugin loads beside them.
"""

import re
import shutil
import site
import subprocess
import sys
import tarfile
import venv
import zipfile
from dataclasses import dataclass
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.metadata import Metadata
from packaging.requirements import Requirement

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("config", "drivers", "sim", "controller")
BUILD = "import sys; from setuptools import build_meta as b; b.build_{kind}(sys.argv[1])"

USERS_TEST = """
import config, controller, drivers, sim
import dynamixel_sdk


def test_packages_of_the_same_names_are_the_users():
    assert [p.OWNER for p in (config, controller, drivers, sim)] == ["user"] * 4


def test_the_bus_answers(servo_bus):
    bus = servo_bus("1-2:XL330-M288")
    packets = dynamixel_sdk.PacketHandler(2.0)
    model, result, error = packets.ping(bus.line, 2)
    assert (model, result, error) == (1200, 0, 0)
"""

LIGHT_TEST = """
from pathlib import Path

import dynamixel_sdk
import pytest


def test_a_device_in_real_time(servo_bus, monkeypatch):
    real_ms = dynamixel_sdk.PortHandler.getCurrentTime  # the SDK waits 34 ms: a busy machine more
    monkeypatch.setattr(dynamixel_sdk.PortHandler, "getCurrentTime", lambda p: real_ms(p) / 50)
    bus = servo_bus("1-2:XL330-M288")
    port = dynamixel_sdk.PortHandler(bus.path)
    assert port.openPort()
    assert dynamixel_sdk.PacketHandler(2.0).write1ByteTxRx(port, 1, 64, 1) == (0, 0)
    assert bus["Torque Enable"].tolist() == [1, 0]
    port.closePort()


def test_motion_and_a_fault_in_simulated_time(servo_bus):
    packets = dynamixel_sdk.PacketHandler(2.0)
    Path("faults.toml").write_text('[[fault]]\\nkind = "mute"\\nids = [2]\\nat_s = 0.1\\n')
    bus = servo_bus("1-2", faults="faults.toml")
    assert packets.ping(bus.line, 2)[1] == 0
    packets.write1ByteTxRx(bus.line, 1, 64, 1)
    packets.write4ByteTxRx(bus.line, 1, 116, 2500)
    group = dynamixel_sdk.GroupSyncRead(bus.line, packets, 132, 4)
    group.addParam(1)
    while abs(group.getData(1, 132, 4) - 2500) > 20:
        assert group.txRxPacket() == 0
    assert packets.ping(bus.line, 2)[1] == dynamixel_sdk.COMM_RX_TIMEOUT


def test_protocol_1(servo_bus):
    bus = servo_bus("3:AX-12A")
    assert dynamixel_sdk.PacketHandler(1.0).ping(bus.line, 3) == (12, 0, 0)


@pytest.mark.parametrize("module", ["numba", "scipy", "networkx", "typer", "rich", "mcap"])
def test_what_is_left_out_is_not_there(module):
    with pytest.raises(ModuleNotFoundError):
        __import__(module)
"""


@dataclass(frozen=True)
class Installed:
    """A wheel in an environment of its own."""

    bin: Path
    packages: Path
    """Where it is installed."""
    project: Path
    """The user's project, from which commands run."""

    def run(self, *command: str) -> str:
        """Output of a command of the environment, started in the user's project."""
        # loops run as they stand: to compile them takes half a minute, and is tested elsewhere
        environment = {"PATH": str(self.bin), "NUMBA_DISABLE_JIT": "1", "TERM": "dumb"}
        done = subprocess.run(
            [str(self.bin / command[0]), *command[1:]],
            cwd=self.project,
            env=environment,
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout


def build(kind: str, source: Path, folder: Path) -> Path:
    """Build a wheel or an sdist without network and return its file."""
    done = subprocess.run(
        [sys.executable, "-c", BUILD.format(kind=kind), str(folder)],
        cwd=source,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    (made,) = folder.glob("*.whl" if kind == "wheel" else "*.tar.gz")
    return made


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy of what is shipped, links as links, so that nothing is built in this clone."""
    copy = tmp_path_factory.mktemp("source")
    for folder in (*FOLDERS, "snakewalk"):
        rubbish = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / folder, copy / folder, symlinks=True, ignore=rubbish)
    for file in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / file, copy / file)
    return copy


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """As pip builds it from a clone; ``build`` and package indexes go through the sdist."""
    return build("wheel", source, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """Install the wheel alone; what it depends on is taken from the environment of this test."""
    home = tmp_path_factory.mktemp("environment")
    venv.create(home, with_pip=False, symlinks=True)
    (packages,) = home.glob("lib/python*/site-packages")
    # a folder named in a .pth is searched last, and its own .pth (an editable install) is not read
    (packages / "dependencies.pth").write_text("\n".join(site.getsitepackages()))
    pip = [sys.executable, "-m", "pip", "--python", str(home / "bin" / "python"), "install"]
    quiet = ["--quiet", "--no-deps", "--no-index", "--force-reinstall", "--no-compile"]
    subprocess.run([*pip, *quiet, "--prefix", str(home), str(wheel)], check=True, timeout=600)

    project = tmp_path_factory.mktemp("project")
    for name in FOLDERS:
        (project / name).mkdir()
        (project / name / "__init__.py").write_text('OWNER = "user"\n')
    (project / "test_user.py").write_text(USERS_TEST)
    return Installed(home / "bin", packages, project)


def shipped(source: Path) -> set[str]:
    """Every file that a wheel has to hold, as it is named in it."""
    kinds = {".css", ".html", ".js", ".mcap", ".py", ".toml", ".typed"}
    found = [file for name in FOLDERS for file in (source / name).rglob("*")]
    own = [file for file in (source / "snakewalk").iterdir() if not file.is_symlink()]
    files = {file.relative_to(source) for file in found if file.suffix in kinds}
    return {f"snakewalk/{file}" for file in files} | {f"snakewalk/{file.name}" for file in own}


def names_in_wheel(wheel: Path) -> set[str]:
    with zipfile.ZipFile(wheel) as file:
        return set(file.namelist())


def test_a_wheel_holds_every_file_and_one_top_level_name(source: Path, wheel: Path) -> None:
    names = names_in_wheel(wheel)
    assert {name.split("/")[0] for name in names if ".dist-info/" not in name} == {"snakewalk"}
    assert {name for name in names if ".dist-info/" not in name} == shipped(source)


@pytest.mark.slow
def test_a_wheel_built_from_the_sdist_is_the_same(
    source: Path, wheel: Path, tmp_path: Path
) -> None:
    """Both state the same valid metadata, with the page that a package index shows."""
    sdist = build("sdist", source, tmp_path)
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        stated = Metadata.from_email(archive.read(name))
    with tarfile.open(sdist) as file:
        inner = file.extractfile(f"snakewalk-{stated.version}/PKG-INFO")
        assert inner is not None
        in_sdist = Metadata.from_email(inner.read())
        assert in_sdist.as_rfc822().as_bytes() == stated.as_rfc822().as_bytes()
        assert (stated.description or "").startswith("# snakewalk")
        file.extractall(tmp_path / "unpacked", filter="data")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    (tmp_path / "again").mkdir()
    assert names_in_wheel(build("wheel", unpacked, tmp_path / "again")) == names_in_wheel(wheel)


def test_what_is_installed_at_the_top(installed: Installed) -> None:
    ours = {path.name for path in installed.packages.iterdir() if path.suffix != ".pth"}
    assert {name for name in ours if not name.startswith("snakewalk-")} == {"snakewalk"}


def test_the_command_runs_in_a_users_project(installed: Installed) -> None:
    assert "Usage: snakewalk" in installed.run("snakewalk", "--help")
    assert "flat-slalom" in installed.run("snakewalk", "list", "--json")


def test_a_users_suite_keeps_its_packages_and_has_the_fixture(installed: Installed) -> None:
    # started as a module, the user's project comes first on the path, also for our plugin
    found = installed.run("python", "-c", "import snakewalk; print(snakewalk.__file__)")
    assert Path(found.strip()).is_relative_to(installed.packages)
    assert "2 passed" in installed.run("python", "-m", "pytest", "-q", "-p", "no:cacheprovider")


def distributions_of(names: list[str]) -> set[str]:
    """Those that pip installs for ``names``, as this environment has them."""
    found: set[str] = set()
    while names:
        name = names.pop()
        if name not in found:
            found.add(name)
            wanted = map(Requirement, distribution(name).requires or [])
            names += [one.name for one in wanted if not one.marker or one.marker.evaluate()]
    return found


@pytest.fixture(scope="module")
def light(installed: Installed, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of packages: this one, and what the page tells people to install beside it."""
    page = (ROOT / "docs" / "start" / "ci.md").read_text(encoding="utf-8")
    ((ours, theirs),) = re.findall(
        r"^    pip install --no-deps (\S+)\n(?:    # .*\n)?    pip install (.+)$", page, re.M
    )
    assert ours == "snakewalk"
    folder = tmp_path_factory.mktemp("light")
    for place in installed.packages.glob("snakewalk*"):
        (folder / place.name).symlink_to(place)
    for name in distributions_of(theirs.split()):
        known = distribution(name)
        for top in {file.parts[0] for file in known.files or [] if ".." not in file.parts}:
            if top != "__pycache__":
                (folder / top).symlink_to(Path(str(known.locate_file(top))))
    return folder


def lightly(light: Path, folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    """Run Python on the light install, without the environment's own packages."""
    return subprocess.run(
        [sys.executable, "-S", *words],
        cwd=folder,
        env={"PYTHONPATH": str(light), "PATH": ""},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


def test_the_fixture_needs_no_more_than_the_page_says(light: Path, tmp_path: Path) -> None:
    (tmp_path / "test_light.py").write_text(LIGHT_TEST)
    done = lightly(light, tmp_path, "-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert "9 passed" in done.stdout, done.stdout + done.stderr


def test_what_needs_more_says_what_to_install(light: Path, tmp_path: Path) -> None:
    command = "from snakewalk.controller.cli.main import main; main()"
    done = lightly(light, tmp_path, "-c", command)
    assert done.returncode == 2
    assert done.stderr == (
        "snakewalk: this needs typer, which a light install leaves out: pip install snakewalk\n"
    )
