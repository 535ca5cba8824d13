"""``snakewalk gait fit``: a table of points in, joint angles and their residual out."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.loader import load_robot
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.cli.main import main
from snakewalk.controller.gaits.backbone import fit_backbone

pytestmark = pytest.mark.usefixtures("legible_figures")

runner = CliRunner()
RUN_M = np.linspace(0.0, 1.4, 300)
HELIX_M = np.stack(
    [0.14 * np.cos(RUN_M / 0.15), -0.14 * np.sin(RUN_M / 0.15), -0.35 * RUN_M], axis=1
)
STRAIGHT = "x_m,y_m,z_m\n" + "".join(f"{-0.5 * k},0,0\n" for k in range(5))
SHORT = "x_m,y_m,z_m\n" + "".join(f"{-0.1 * k},0,0\n" for k in range(4))


def write(path: Path, points_m: np.ndarray) -> Path:
    """With a column more, and in another order: names count."""
    rows = (f"{k},{z!r},{x!r},{y!r}\n" for k, (x, y, z) in enumerate(points_m.tolist()))
    path.write_text("point, z_m, x_m, y_m\n" + "".join(rows))
    return path


@pytest.mark.slow
def test_a_helix_becomes_the_angles_of_the_library(tmp_path: Path) -> None:
    curve = write(tmp_path / "helix.csv", HELIX_M)
    out, picture = tmp_path / "joints.npz", tmp_path / "fit.png"
    words = ["gait", "fit", str(curve), "-o", str(out), "--picture", str(picture), "--json"]
    result = runner.invoke(app, words)
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    robot = load_robot("alternating16")
    fit = fit_backbone(robot, HELIX_M)
    assert found["robot"] == robot.name
    assert found["residual_m"] == pytest.approx(fit.residual_m, abs=1e-6)
    assert 0.0 < found["residual_m"] < 0.02
    np.testing.assert_allclose(found["joint_rad"], fit.joint_rad, atol=1e-5)
    with np.load(out) as file:
        np.testing.assert_allclose(file["joint_rad"], fit.joint_rad, atol=1e-9)
        apart = np.linalg.norm(np.diff(file["points_m"], axis=0), axis=1)
        assert str(file["robot"]) == robot.name
    np.testing.assert_allclose(apart, robot.mean_link_length_m)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_straight_curve_is_met_exactly_by_any_robot(tmp_path: Path) -> None:
    curve = tmp_path / "straight.csv"
    curve.write_text(STRAIGHT)
    result = runner.invoke(app, ["gait", "fit", str(curve), "--robot", "yaw16", "--json"])
    found = json.loads(result.stdout)
    assert found["residual_m"] < 1e-6
    assert np.abs(found["joint_rad"]).max() < 1e-5
    printed = runner.invoke(app, ["gait", "fit", str(curve)]).output
    assert re.search(r"residual +\S+ m\b", printed)


def test_help_gives_an_example() -> None:
    assert "snakewalk gait fit CURVE.csv" in runner.invoke(app, ["gait", "fit", "--help"]).output


@pytest.mark.fast_cases(7)
@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        (None, [], "curve.csv: no such file"),
        ("x,y_m,z_m\n0,0,0\n", [], "no column x_m; the first line names"),
        ("", [], "no column x_m, y_m, z_m"),
        (STRAIGHT + "-3,left,0\n", [], "line 7: y_m: expected a number or nothing"),
        (STRAIGHT + "-3,0\n", [], "line 7 lacks one of x_m, y_m, z_m"),
        (STRAIGHT + "-3,0,nan\n", [], "line 7 lacks one of x_m, y_m, z_m"),
        ("x_m,y_m,z_m\n0,0,0\n-1,0,0\n", [], "curve.csv: the curve has shape (2, 3)"),
        (SHORT, ["--robot", "yaw16"], "curve.csv: the curve is 0.300 m long; robot yaw16 has"),
        (STRAIGHT.replace("-1.0", "-0.5"), [], "neighbours must differ"),
        (STRAIGHT, ["--robot", "hop"], "hop"),
        (STRAIGHT, ["--picture", "fit.txt"], "a picture ends in .png"),
        (STRAIGHT, ["-o", "joints.txt"], "ends in .npz"),
        (STRAIGHT, ["-o", "curve.npz"], "curve.npz: exists; --force overwrites it"),
        (STRAIGHT, ["-o", "nowhere/joints.npz"], "nowhere: no such folder"),
    ],
)
def test_bad_input_ends_with_code_2_and_one_line(
    text: str | None,
    words: list[str],
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("curve.npz").write_bytes(b"mine")
    if text is not None:
        Path("curve.csv").write_text(text)
    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr(sys, "argv", ["snakewalk", "gait", "fit", "curve.csv", *words])
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("snakewalk:")
    assert said in lines[0]
    assert sorted(tmp_path.iterdir()) == before
    assert Path("curve.npz").read_bytes() == b"mine"


def test_force_replaces_a_result(tmp_path: Path) -> None:
    curve, out = tmp_path / "curve.csv", tmp_path / "joints.npz"
    curve.write_text(STRAIGHT)
    out.write_bytes(b"old")
    assert runner.invoke(app, ["gait", "fit", str(curve), "-o", str(out), "--force"]).exit_code == 0
    with np.load(out) as file:
        assert file["joint_rad"].shape == (16,)
