"""The steps of the pages that extend snakewalk, carried out as printed."""

import csv
import json
import re
import runpy
import shlex
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from snakewalk.controller.console import plugins
from tests.architecture import manifests
from tests.helpers.command import snakewalk
from tests.helpers.page_steps import Library, Page, page

pytestmark = pytest.mark.costs("extends a copy of the library")

IN_THE_TREE = {
    "add-a-gait": 1,
    "add-a-command": 1,
    "add-a-fault-kind": 2,
    "add-a-measured-quantity": 7,
}
"""Files that each extension touches."""
OUTSIDE = ("add-a-motion-source", "add-a-pose-source")
PROGRAM = """
import contextlib, io, json, shlex, sys
from snakewalk.controller.cli.main import main

shown = {}
for line in json.loads(sys.argv[1]):
    sys.argv = shlex.split(line)
    with contextlib.redirect_stdout(io.StringIO()) as out:
        try:
            main()
        except SystemExit as ended:
            if ended.code:
                raise
    shown[line] = out.getvalue()
print(json.dumps(shown))
"""


@dataclass(frozen=True)
class Extended:
    """A copy of the library that was extended, and what its commands print."""

    folder: Path
    shown: dict[str, str]


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Extended:
    """Follow all pages that change the tree, in one copy, and run their commands."""
    pytest.importorskip("mujoco")
    folder = tmp_path_factory.mktemp("extended")
    library = Library(tmp_path_factory.mktemp("library"))
    lines: list[str] = []
    for name in IN_THE_TREE:
        steps = page(name)
        inside = {path: body for path, body in steps.files.items() if "/" in path}
        for path in steps.files.keys() - inside:
            (folder / path).write_text(steps.files[path], encoding="utf-8")
        library.apply(Page(steps.text, inside, steps.changes, []))
        lines += [line for line in steps.commands if "LOG" not in line]
    write_manifests(library)
    shown = library.run(PROGRAM.replace("sys.argv[1]", repr(json.dumps(lines))), folder)
    return Extended(folder, json.loads(shown))


def write_manifests(library: Library) -> None:
    """Generate the manifests of a copy, as ``python -m tests.architecture.manifests`` does."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(manifests, "ROOT", library.top)
        for package in manifests.packages():
            written, file = manifests.text(package), package / "manifest.py"
            if written and file.read_text(encoding="utf-8") != written:
                file.unlink()
                file.write_text(written, encoding="utf-8")


def only(shown: dict[str, str], words: str) -> str:
    [line] = [line for line in shown if words in line]
    return shown[line]


@pytest.mark.parametrize("name", [*IN_THE_TREE, *OUTSIDE])
def test_the_first_command_is_within_ten_lines(name: str) -> None:
    assert any(line.startswith("snakewalk ") for line in page(name).text.splitlines()[:10])


@pytest.mark.parametrize(("name", "count"), IN_THE_TREE.items())
def test_a_page_touches_as_many_files_as_it_says(name: str, count: int) -> None:
    steps = page(name)
    touched = {path for path in steps.touched if "/" in path}
    touched |= {"docs/export.md"} if "`docs/export.md`" in steps.text else set()
    assert len(touched) == count
    files = steps.text.partition("\n## Files\n")[2]
    assert re.search(rf"^(?:You change )?{count} files?\b", files, re.MULTILINE)


@pytest.mark.slow
def test_a_gait_is_found_shown_and_run(extended: Extended) -> None:
    assert "sway" in only(extended.shown, "gait list")
    assert "bend_rad" in only(extended.shown, "gait show sway")
    assert "first" in only(extended.shown, "gait run sway")


@pytest.mark.slow
def test_a_command_is_listed_and_runs(extended: Extended) -> None:
    assert "length" in only(extended.shown, "robot --help")
    assert "1.19" in only(extended.shown, "robot length yaw16")
    assert "Print the length of a robot." in extended.shown["snakewalk robot length --help"]


@pytest.mark.slow
def test_a_fault_kind_is_accepted_and_played(extended: Extended) -> None:
    assert '"hang"' in only(extended.shown, "tools schema faults")
    assert any("hang.toml" in line for line in extended.shown)


@pytest.mark.slow
def test_a_measured_quantity_is_in_summary_report_and_export(extended: Extended) -> None:
    folder = extended.folder
    with (folder / "tables/cycle.csv").open(encoding="utf-8") as file:
        rates = {row["rate"] for row in csv.DictReader(file)}
    assert rates == {"1.0"}
    assert json.loads((folder / "quantity/summary.json").read_text())["lowest_rate"] == 1.0
    report = (folder / "quantity/report.html").read_text(encoding="utf-8")
    assert "Lowest rate" in report


def test_a_motion_source_is_one_file_of_the_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mujoco")
    [(name, body)] = page("add-a-motion-source").files.items()
    (tmp_path / name).write_text(body, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    unknown = snakewalk("run", "--motion", "nosuch")
    assert (unknown.returncode, "valid: " in unknown.stderr) == (2, True)
    runpy.run_path(name, run_name="__main__")
    assert capsys.readouterr().out.startswith("the body went 0.")


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Install the package of the page of pose sources, as an installer does."""
    files = page("add-a-pose-source").files
    site = tmp_path / "site"
    (site / "my_snake").mkdir(parents=True)
    for path in ("my_snake/mocap.py", "my_snake/manifest.py"):
        (site / path).write_text(files[path], encoding="utf-8")
    project = tomllib.loads(files["pyproject.toml"])["project"]
    info = site / "my_snake-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: 1.0")
    [(group, entries)] = project["entry-points"].items()
    rows = [f"{key} = {value}" for key, value in entries.items()]
    (info / "entry_points.txt").write_text("\n".join([f"[{group}]", *rows, ""]))
    monkeypatch.syspath_prepend(site)
    monkeypatch.chdir(tmp_path)
    plugins.foreign_plugins.cache_clear()
    yield tmp_path
    plugins.foreign_plugins.cache_clear()
    for name in [name for name in sys.modules if name.startswith("my_snake")]:
        del sys.modules[name]


@pytest.mark.slow
def test_a_pose_source_is_a_package_of_the_user(installed: Path) -> None:
    pytest.importorskip("mujoco")
    steps = page("add-a-pose-source")
    [line] = [line for line in steps.commands if " run " in line]
    words = shlex.split(line)[1:]
    absent = snakewalk(*words)
    assert absent.returncode == 2
    assert "start the tracking program first" in absent.stderr
    poses = steps.text.partition("```text\n")[2].partition("```")[0]
    (installed / "poses.txt").write_text(poses, encoding="utf-8")
    assert "pose mocap" in snakewalk("list").stdout
    done = snakewalk(*words, "--json")
    result = json.loads(done.stdout)
    assert result["pose_source"] == "mocap", done.stderr
    assert 0.0 < result["head_error_rms_m"] < 0.3
