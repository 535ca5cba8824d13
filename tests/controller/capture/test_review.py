"""A person's corrections: the page in a browser, the file that it saves, the track they make."""

import json
import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import CaptureFile, load_capture, save_capture
from snakewalk.controller.capture.capturing import capture_recording, correct_recording
from snakewalk.controller.capture.corrections import (
    Corrections,
    RedrawnFrame,
    apply_corrections,
    read_corrections,
)
from snakewalk.controller.capture.review import picture_scale, review_page
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.readers.load import load_track
from tests.helpers.browser import IN_A_BROWSER, chromium, new_tab
from tests.helpers.command import snakewalk
from tests.helpers.film_options import film_options
from tests.oracles.rendered_snake import SnakeScene, empty, film, true_midlines

SCENE = SnakeScene(rows=210, columns=240, length_px=125.0, frames=16, wave_hz=1.0)
LOST = 9


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A captured film, one frame of which shows no animal, with its page."""
    made = tmp_path_factory.mktemp("reviewed")
    (made / "frames").mkdir()
    for number, frame in enumerate(film(SCENE)):
        shown = empty(SCENE) if number == LOST else frame
        cv2.imwrite(str(made / "frames" / f"{number}.png"), shown)
    cv2.imwrite(str(made / "ground.png"), empty(SCENE))
    capture_recording(
        film_options(
            made / "frames", made / "track.npz", rate_hz=30.0, review=made / "review.html",
            background=made / "ground.png",
            length_m=0.35,
        )
    )  # fmt: skip
    return made


@pytest.fixture(scope="module")
def held(folder: Path) -> CaptureFile:
    return load_capture(folder / "track.npz")


def test_what_was_saved_is_loaded_again_and_the_page_is_of_it(
    folder: Path, held: CaptureFile, tmp_path: Path
) -> None:
    again = tmp_path / "again.npz"
    save_capture(again, held)
    with np.load(folder / "track.npz") as one, np.load(again) as other:
        assert one.files == other.files
        assert all(np.array_equal(one[n], other[n], equal_nan=one[n].dtype.kind == "f")
                   for n in one.files)  # fmt: skip
    page = (folder / "review.html").read_text()
    said = re.search(r'id="data">(.*?)</script>', page, re.DOTALL)
    assert said is not None
    data = json.loads(said[1])
    (animal,) = data["animals"]
    assert animal["track"] == held.fingerprint
    assert len(data["images"]) == len(animal["status"]) == 16
    assert animal["points"][LOST] is None
    assert data["sizes"] == [[240, 210]] * 16
    assert data["words"][animal["status"][LOST]] == "nothing seen"
    assert not re.search(r"(src|href)\s*=\s*[\"']?http", page), "the page needs no network"


def test_heads_are_flipped_frames_left_out_and_redrawn(held: CaptureFile) -> None:
    line = true_midlines(SCENE)[LOST] + 0.25
    said = Corrections(
        track=held.fingerprint, frames=16, flipped=(3, 4), left_out=(7, 3),
        redrawn=(RedrawnFrame(frame=LOST, points_px=tuple(map(tuple, line[::4].tolist()))),),
    )  # fmt: skip
    fixed = apply_corrections(held, said, "c.json")
    before, after = held.captured, fixed.captured
    assert np.array_equal(after.points_px[4], before.points_px[4][::-1])
    assert np.array_equal(after.radius_px[4], before.radius_px[4][::-1])
    assert [after.status[k] for k in (3, 7)] == [FrameStatus.LEFT_OUT] * 2
    assert np.isnan(after.points_px[[3, 7]]).all()
    assert after.status[LOST] is FrameStatus.BY_HAND
    chord = np.hypot(*np.diff(after.points_px[LOST], axis=0).T)
    assert np.ptp(chord) < 1e-6 * chord.mean()
    assert np.hypot(*(after.points_px[LOST] - line).T).max() < 0.5
    assert np.isnan(after.expected_px[LOST])
    assert after.used.sum() == 14
    assert after.margin[5] < 0.0, "the frame before is the wrong way round now"
    same = [k for k in range(16) if k not in (3, 4, 7, LOST)]
    assert np.array_equal(after.points_px[same], before.points_px[same])
    assert (after.head_by, after.head_sure) == ("given", 1.0)
    with pytest.raises(InputError, match="belong to another track"):
        apply_corrections(fixed, said, "c.json")


def test_the_command_writes_a_track_that_loads(
    folder: Path, held: CaptureFile, tmp_path: Path
) -> None:
    said = Corrections(track=held.fingerprint, frames=16, left_out=(0, 1), flipped=(5,))
    words = tmp_path / "c.json"
    words.write_text(said.model_dump_json())
    assert read_corrections(words) == said
    done = snakewalk(
        "animal", "capture", str(folder / "track.npz"), "--corrections", str(words), "-o",
        str(tmp_path / "new.npz"), "--json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert (facts["frames_left_out"], facts["frames_flipped"], facts["frames_used"]) == (2, 1, 13)
    assert facts["frames_with_unsure_head"] == 2
    track = load_track(str(tmp_path / "new.npz"))
    assert track.frames == 13
    assert track.flips > 0
    assert track.length_m == pytest.approx(0.35, rel=0.02)
    assert "corrected by a person: 1 frames flipped, 2 left out, 0 redrawn" in track.source


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"left_out": [16]}, "frame 16 is not there: the track has 16, from 0"),
        ({"flipped": [2, 2]}, "flipped: frame 2 is listed twice"),
        ({"left_out": list(range(15))}, "fewer than 2 frames"),
        ({"track": "another"}, "belong to another track"),
        ({"flipped": ["3"]}, "flipped"),
        ({"swapped": [3]}, "swapped"),
        (
            {"redrawn": [{"frame": 3, "points_px": [[0, 0], [1, 0], [900, 0], [2, 0]]}]},
            "1798.0 px long",
        ),
        ({"redrawn": [{"frame": 3, "points_px": [[0, 0], [1, 1]]}]}, "points_px"),
    ],
)
def test_wrong_corrections_are_refused(
    folder: Path, held: CaptureFile, tmp_path: Path, change: dict[str, object], said: str
) -> None:
    file = tmp_path / "c.json"
    file.write_text(json.dumps({"track": held.fingerprint, "frames": 16} | change))
    options = film_options(folder / "track.npz", tmp_path / "new.npz", corrections=file)
    with pytest.raises(InputError, match=said):
        correct_recording(options)
    assert not (tmp_path / "new.npz").exists()


def test_wrong_files_and_options_are_refused(folder: Path, tmp_path: Path) -> None:
    junk = tmp_path / "junk.json"
    junk.write_text("[1")
    track = folder / "track.npz"
    new = tmp_path / "new.npz"
    for options, said in (
        (film_options(track, new, corrections=junk), "is not JSON"),
        (film_options(track, new, corrections=tmp_path / "no.json"), "No such file"),
        (
            film_options(track, new, corrections=junk, roi="1,2,3,4"),
            "leave the other options out",
        ),
        (film_options(track, track, corrections=junk), "exists; --force"),
        (
            film_options(track, tmp_path / "a.csv", corrections=junk),
            "a corrected track ends in .npz",
        ),
    ):
        with pytest.raises(InputError, match=said):
            correct_recording(options)
    with pytest.raises(InputError, match=r"a review page ends in \.html"):
        capture_recording(film_options(folder / "frames", new, review=tmp_path / "a.doc"))
    np.savez(tmp_path / "other.npz", points=np.zeros((3, 5, 2)))
    for file in (tmp_path / "other.npz", junk):
        with pytest.raises(InputError, match=r"`animal capture` wrote"):
            load_capture(file)


def test_a_page_stays_one_that_a_browser_opens() -> None:
    noise = np.random.default_rng(0).integers(0, 255, (900, 1600), dtype=np.uint8)
    assert picture_scale([noise[:480, :640]], 50, "short") == 1.0
    assert picture_scale([noise], 50, "wide") == pytest.approx(0.8)
    assert 0.2 < picture_scale([noise], 1500, "long") < 0.6
    with pytest.raises(InputError, match="a page with pictures of 900000 frames"):
        picture_scale([noise], 900_000, "endless")


@pytest.mark.slow
@IN_A_BROWSER
def test_a_person_flips_drops_drags_and_saves(
    folder: Path, held: CaptureFile, tmp_path: Path
) -> None:
    with chromium() as browser:
        page = new_tab(browser, viewport={"width": 1100, "height": 720})
        wrong: list[str] = []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda asked: wrong.append(asked.url) if "http" in asked.url[:5] else 0)
        page.goto((folder / "review.html").as_uri())
        page.get_by_text("frame 0 of 0 to 15").wait_for()
        for number in range(1, LOST + 1):  # a film below 20 frames has no good one
            page.get_by_role("button", name="next doubtful frame").click()
            page.get_by_text(f"frame {number} of").wait_for()
        page.keyboard.press("c")  # the neighbour's skeleton, then its head pulled
        where = "JSON.stringify((() => { const p = place().to(points(at)[0]);"
        where += "const r = film.getBoundingClientRect(); return [p[0] + r.x, p[1] + r.y,"
        where += "place().scale]; })())"
        x, y, scale = json.loads(page.evaluate(where))
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 3.0 * scale, y + 2.0 * scale, steps=4)
        page.mouse.up()
        page.keyboard.press("Home")
        page.keyboard.press("f")
        page.keyboard.press("ArrowRight")
        page.get_by_role("button", name="leave out").click()
        page.keyboard.press("End")
        page.keyboard.press("[")
        page.keyboard.press("ArrowLeft")
        page.keyboard.press("]")
        page.keyboard.press("x")
        page.get_by_text("1 flipped, 3 left out, 1 redrawn, not saved").wait_for()
        page.get_by_role("button", name="in the whole film").click()
        page.get_by_text("14 flipped, 3 left out, 1 redrawn, not saved").wait_for()
        page.keyboard.press("Control+z")
        page.keyboard.press("Control+z")
        page.get_by_text("1 flipped, 1 left out, 1 redrawn, not saved").wait_for()
        with page.expect_download() as waiting:
            page.get_by_role("button", name="save corrections").click()
        saved = tmp_path / waiting.value.suggested_filename
        waiting.value.save_as(saved)
        page.reload()
        page.get_by_text("no corrections").wait_for()
        page.set_input_files("#load", str(saved))
        page.get_by_text("1 flipped, 1 left out, 1 redrawn").wait_for()
    assert not wrong
    assert saved.name == "track-corrections.json"
    said = read_corrections(saved)
    assert (said.flipped, said.left_out) == ((0,), (1,))
    fixed = apply_corrections(held, said, saved.name).captured
    assert fixed.status[LOST] is FrameStatus.BY_HAND
    head, was = fixed.points_px[LOST][0], held.captured.points_px[LOST - 1][0]
    assert np.allclose(head - was, [3.0, 2.0], atol=0.3)
    tail, was_tail = fixed.points_px[LOST][-1], held.captured.points_px[LOST - 1][-1]
    assert np.allclose(tail, was_tail, atol=0.05)


def test_images_of_different_sizes_keep_them(held: CaptureFile) -> None:
    frames = [frame[: 100 + k] for k, frame in enumerate(film(SCENE))]
    text = review_page([held], frames, scale=0.5, tracks=[Path("track.npz")])
    data = json.loads(text.split('id="data">')[1].split("</script>")[0])
    assert data["sizes"] == [[240, 100 + k] for k in range(16)]


def test_a_name_steers_no_page(held: CaptureFile) -> None:
    named = replace(held, name="</script><img src=x onerror=alert(1)>")
    text = review_page([named], list(film(SCENE)), scale=1.0, tracks=[Path("track.npz")])
    assert "<img" not in text
