"""``snakewalk pose``: a board that is printed, pictures of it, the lens; and what is refused."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.controller.cameras.calibration_board import CalibrationBoard
from snakewalk.controller.cameras.lens import Lens
from snakewalk.controller.cameras.markers.floor_markers import find_markers
from snakewalk.controller.cli.command_line import app
from tests.oracles.board_view import board_pictures

MATRIX = np.array([[300.0, 0.0, 158.0], [0.0, 300.0, 121.0], [0.0, 0.0, 1.0]])
LENS = Lens((320, 240), MATRIX, np.array([-0.2, 0.05, 0.0, 0.0, 0.0]))


def call(*words: str) -> dict[str, object]:
    done = CliRunner().invoke(app, [*words, "--json"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    found: dict[str, object] = json.loads(done.stdout)
    return found


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pictures")
    for k, picture in enumerate(board_pictures(CalibrationBoard("charuco"), LENS, 9)):
        cv2.imwrite(str(folder / f"{k}.png"), picture)
    return folder


def test_pictures_in_a_folder_give_the_lens(pictures: Path, tmp_path: Path) -> None:
    out = tmp_path / "lens.yml"
    told = call("pose", "lens", str(pictures), "-o", str(out))
    assert told["used"] == told["pictures"] == 9
    assert float(str(told["residual_rms_px"])) < 0.4
    lens = Lens.read(out)
    assert lens.matrix[0, 0] == pytest.approx(300.0, rel=0.02)
    assert lens.distortion[0] == pytest.approx(-0.2, abs=0.04)


def test_a_film_does_as_well(pictures: Path, tmp_path: Path) -> None:
    film = tmp_path / "board.avi"
    writer = cv2.VideoWriter(str(film), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, LENS.size_px)
    for k in range(9):
        writer.write(cv2.imread(str(pictures / f"{k}.png")))
    writer.release()
    told = call("pose", "lens", str(film), "-o", str(tmp_path / "lens.json"))
    assert told["pictures"] == 9
    assert Lens.read(tmp_path / "lens.json").matrix[0, 0] == pytest.approx(300.0, rel=0.03)


@pytest.mark.parametrize("ending", ["pdf", "png"])
def test_the_board_is_drawn_in_its_size(ending: str, tmp_path: Path) -> None:
    out = tmp_path / f"board.{ending}"
    told = call("pose", "board", "-o", str(out))
    assert (told["width_mm"], told["height_mm"]) == (252.0, 180.0)
    if ending == "png":
        drawn = cv2.imread(str(out), cv2.IMREAD_GRAYSCALE)
        view = CalibrationBoard("charuco").find(np.asarray(drawn, dtype=np.uint8))
        assert view is not None
        assert len(view.corners_px) == 24
        apart_mm = np.hypot(*(view.corners_px[5] - view.corners_px[0])) / 300.0 * 25.4
        assert apart_mm == pytest.approx(5 * 36.0, abs=0.5)
    else:
        box = [float(n) for n in out.read_bytes().split(b"/MediaBox [")[1].split(b"]")[0].split()]
        assert box[2] / 72.0 * 25.4 == pytest.approx(272.0, abs=0.5), "with 10 mm around"


def test_markers_are_printed_in_their_size_one_a_page(tmp_path: Path) -> None:
    told = call("pose", "markers", "-o", str(tmp_path / "m.pdf"), "--count", "3")
    assert told["numbers"] == [0, 1, 2]
    assert (tmp_path / "m.pdf").read_bytes().count(b"/MediaBox") == 3
    told = call("pose", "markers", "-o", str(tmp_path / "m.png"), "--count", "1", "--first", "7")
    drawn = np.asarray(cv2.imread(str(tmp_path / "m.png"), cv2.IMREAD_GRAYSCALE), dtype=np.uint8)
    small = cv2.resize(drawn, None, fx=0.1, fy=0.1, interpolation=cv2.INTER_AREA)
    ((number, corners),) = find_markers(np.asarray(small, dtype=np.uint8)).items()
    assert number == 7
    side_mm = 10.0 * np.hypot(*(corners[1] - corners[0])) / 300.0 * 25.4
    assert side_mm == pytest.approx(150.0, abs=0.5)
    assert drawn.shape[1] / 300.0 * 25.4 == pytest.approx(
        float(str(told["page_width_mm"])), abs=0.2
    )


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("markers", "-o", "m.png"), "holds one marker"),
        (("markers", "-o", "m.pdf", "--first", "48"), "numbers end at 49"),
        (("markers", "-o", "m.pdf", "--side", "2"), "must be 10 to 1000 mm"),
        (("board", "-o", "x.gif"), "a print ends in .pdf, .png"),
        (("board", "-o", "x.pdf", "--squares", "7"), "--squares 7: expected"),
        (("lens", "nowhere", "-o", "lens.yml"), "nowhere"),
        (("lens", "nowhere", "-o", "lens.txt"), "lens.txt: the file of a lens ends in"),
    ],
)
def test_what_cannot_be_done_is_refused(
    words: tuple[str, ...], line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=line):
        CliRunner().invoke(app, ["pose", *words], catch_exceptions=False)
    assert list(tmp_path.iterdir()) == []


def test_pictures_of_two_sizes_are_refused(pictures: Path, tmp_path: Path) -> None:
    for k, side in enumerate((100, 120)):
        cv2.imwrite(str(tmp_path / f"{k}.png"), np.zeros((side, 160), np.uint8))
    with pytest.raises(InputError, match="160 x 100 and 160 x 120"):
        CliRunner().invoke(
            app, ["pose", "lens", str(tmp_path), "-o", str(pictures / "l.yml")],
            catch_exceptions=False,
        )  # fmt: skip
