"""The steps of the ``Containerfile``, run in a temporary folder instead of a container.

Not run: ``apt-get`` and ``useradd``, which would change this machine. What pip would download comes
from the environment of the tests. The last steps run as another account if this one may become it.
"""

import json
import os
import re
import shutil
import site
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.nightly("compiles all loops: 98 s of CPU")

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = ("config", "drivers", "sim", "controller", "snakewalk", "pyproject.toml", "README.md")
UID = 65_534
"""Account without rights, home or files."""
PLACES = re.compile(r"(?<![\w.])/(?=(?:opt|src|dist|home)\b)")


def steps() -> list[tuple[str, str]]:
    """Instructions of the recipe with their words."""
    lines = (ROOT / "Containerfile").read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if line and not line.startswith("#")]
    return [(word, rest) for word, _, rest in (line.partition(" ") for line in kept)]


def readable_python() -> str:
    """Python of this version that every account may start."""
    name = f"python{sys.version_info.major}.{sys.version_info.minor}"
    return next((p for p in (f"/usr/bin/{name}", f"/usr/local/bin/{name}") if Path(p).exists()), "")


class Prefix:
    """A folder in place of the container's root."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.bin = folder / "opt" / "snake" / "bin"
        self.is_root = os.getuid() == 0
        self.words: list[str] = []
        """Words that start a command as the account of ``USER``."""

    def run(self, command: str, **variables: str) -> "subprocess.CompletedProcess[str]":
        """Run the command of a step here."""
        return subprocess.run(
            [*self.words, "/bin/sh", "-c", PLACES.sub(f"{self.folder}/", command)],
            cwd=self.folder / "home" / "snake",
            env={"PATH": os.environ["PATH"], "TERM": "dumb", **variables},
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )

    def venv(self, command: str) -> str:
        """Make the environment, and let it see the packages that pip would download."""
        (self.folder / "bin").mkdir()
        (self.folder / "bin" / "python3").symlink_to(readable_python() or sys.executable)
        done = self.run(f"{self.folder}/bin/{command} --without-pip")
        (packages,) = (self.bin.parent / "lib").glob("python*/site-packages")
        (packages / "dependencies.pth").write_text("\n".join(site.getsitepackages()))
        pip = self.bin / "pip"
        pip.write_text(f'#!/bin/sh\nexec "{self.bin}/python" -m pip "$@"\n')
        pip.chmod(0o755)
        return done.stderr

    def useradd_options(self) -> list[str]:
        """Options of the program that adds an account; it is not run here."""
        text = subprocess.run(["useradd", "--help"], capture_output=True, text=True, check=True)
        return re.findall(r"--[a-z-]+", text.stdout)

    def step(self, word: str, rest: str) -> None:
        """Do a step of the recipe."""
        offline = {"PIP_NO_INDEX": "1", "PIP_NO_DEPS": "1", "PIP_NO_BUILD_ISOLATION": "0"}
        if word == "COPY" and rest == ". /src":
            for name in SHIPPED:
                source, to = ROOT / name, self.folder / "src" / name
                if source.is_file():
                    shutil.copy(source, to)
                    continue
                ignored = shutil.ignore_patterns("__pycache__")
                shutil.copytree(source, to, symlinks=True, ignore=ignored)
        elif word == "USER" and self.is_root:
            shutil.chown(self.folder / "home" / "snake", UID, UID)
            self.words = ["setpriv", f"--reuid={UID}", f"--regid={UID}", "--clear-groups"]
        elif word == "RUN" and rest.startswith("python3 -m venv"):
            assert self.venv(rest) == ""
        elif word == "RUN" and rest.startswith("useradd"):
            assert set(re.findall(r"--[a-z-]+", rest)) <= set(self.useradd_options())
        elif word == "RUN" and not rest.startswith("apt-get"):
            done = self.run(rest, **offline)
            assert done.returncode == 0, (rest, done.stdout, done.stderr)


@pytest.fixture(scope="module")
def container() -> Iterator[Prefix]:
    if os.getuid() == 0 and not (readable_python() and shutil.which("setpriv")):
        pytest.skip("no Python of this version that another account may start")
    with tempfile.TemporaryDirectory(prefix="snakewalk-") as name:  # pytest's are closed to others
        folder = Path(name)
        folder.chmod(0o711)
        for part in ("src", "dist", "home/snake"):
            (folder / part).mkdir(parents=True)
        made = Prefix(folder)
        for word, rest in steps():
            made.step(word, rest)
        yield made
        subprocess.run(["chmod", "-R", "u+w", str(folder / "opt")], check=True)


def test_a_gait_runs_in_a_read_only_installation_without_compiling(container: Prefix) -> None:
    denied = container.run("touch /opt/snake/bin/new")
    assert denied.returncode != 0
    (entry,) = (json.loads(rest) for word, rest in steps() if word == "ENTRYPOINT")
    again = container.run(f"{entry[0]} tools compile", HOME="/nonexistent")
    assert again.returncode == 0, again.stderr
    assert re.search(r"compiled loops +0\b", again.stdout), again.stdout + again.stderr
    command = f"{entry[0]} gait run lateral-undulation --seconds 2 --no-film -o out"
    done = container.run(command, HOME="/nonexistent")
    assert done.returncode == 0, done.stdout + done.stderr
    out = container.folder / "home" / "snake" / "out"
    assert (out / "summary.json").exists()
    assert (out / "summary.json").stat().st_uid == (UID if container.is_root else os.getuid())


def test_the_recipe_has_a_normal_user_at_its_end() -> None:
    assert [word for word, _ in steps()][-3:] == ["USER", "WORKDIR", "ENTRYPOINT"]
