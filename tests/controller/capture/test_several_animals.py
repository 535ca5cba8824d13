"""Several animals in one film: identities through contact, tracks, tables and the page."""

import json
import tracemalloc
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.crossings import compare, identities_in
from snakewalk.config.arrays import DeepImage, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.capture import film_parts
from snakewalk.controller.capture.capture import load_capture, save_capture
from snakewalk.controller.capture.commands.capture import show_facts
from snakewalk.controller.capture.film.results import write_captures
from snakewalk.controller.capture.film_parts import FilmParts
from snakewalk.controller.capture.several.animal_films import (
    find_animals,
    merged_status,
    with_bare_ground,
)
from snakewalk.controller.capture.several.blobs import blobs_of, detector_of_several
from snakewalk.controller.capture.several.identities import identities_of
from snakewalk.controller.capture.several.recording import AnimalsFacts, capture_several
from snakewalk.controller.capture.several.tracklets import Tracklet, TrackletBuilder
from snakewalk.controller.capture.verification.remedies import capture_film
from snakewalk.controller.images.body_detector import BodyDetector, Detection, make_detector
from snakewalk.controller.images.silhouette import Polarity
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.readers.load import load_file
from tests.helpers.captured import capture
from tests.helpers.film_options import changed, film_options
from tests.oracles.rendered_crossings import CrossingScene, crossing_film, crossing_midlines
from tests.oracles.skeleton_accuracy import point_error

PAIR = CrossingScene(
    animals=2, rows=420, columns=420, length_px=130.0, frames=24, rate_hz=10.0, speed=1.0,
    sizes=0.05, seed=25,
)  # fmt: skip
PLATE = CrossingScene(length_px=50.0, sizes=0.1, greys=10.0)


@pytest.mark.slow_cases(1, "2 cases of 2.6 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("seed", [500, 503])
def test_identities_are_kept_through_crossings(seed: int) -> None:
    scene = CrossingScene(seed=seed, frames=110)
    midlines = crossing_midlines(scene)
    count = compare(identities_in(list(crossing_film(scene, midlines))), midlines, 60.0)
    assert count.found == 3
    assert count.kept == count.bridged > 0
    assert count.swapped_silently == 0


@pytest.mark.slow_cases(3, "3 cases of 1.5 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 4, 5])
def test_animals_that_cross_in_a_short_film_are_not_followed_in_pieces(seed: int) -> None:
    """Each animal moves less than its length: a fixed background contains its middle."""
    scene = CrossingScene(animals=2, frames=20, rate_hz=10.0, seed=seed)
    images = list(crossing_film(scene, crossing_midlines(scene)))
    detector = with_bare_ground(detector_of_several(images), images)
    found = find_animals(images, images, detector, requested_count=None, name="film")
    assert len(found.identities) == 2


@pytest.mark.nightly("a further film: 5 s of CPU")
def test_animals_that_hardly_move_are_not_part_of_the_background() -> None:
    """In 24 frames each worm crawls 0.7 of its length: most of its pixels stay covered."""
    scene = replace(PLATE, animals=10, rows=420, columns=520, roam=0.38, frames=24, seed=3101)
    midlines = crossing_midlines(scene)
    images = list(crossing_film(scene, midlines))
    detector = detector_of_several(images)
    assert detector.background is None
    count = compare(identities_in(images), midlines, scene.length_px)
    assert count.found >= 9
    assert count.short <= 1


@pytest.mark.nightly("a further film: 2 s of CPU")
def test_stains_do_not_replace_a_background_that_shows_the_animals() -> None:
    scene = replace(PLATE, animals=4, rows=300, columns=300, frames=90, seed=3102)
    images = list(crossing_film(scene, crossing_midlines(scene)))
    for image in images:
        for k in range(6):
            cv2.circle(image, (30 + 45 * k, 20 + 40 * (k % 2)), 9, 60, -1)
    assert detector_of_several(images[::4]).background is not None


def _alone(
    frames: range, start: Floats, step: Floats, begins: int | None, ends: int | None
) -> Tracklet:
    one = Tracklet(begins, ends)
    for k, frame in enumerate(frames):
        one.place(frame, 0, start + k * step, np.log([50.0, 4.0, 90.0]))
    return one


def test_a_crossing_that_motion_and_shape_do_not_decide_is_reported() -> None:
    """Animals that look the same: two that pass each other, and two that rest on each other."""
    right, up = np.array([2.0, 0.0]), np.array([0.0, 2.0])
    decided = [
        _alone(range(20), np.array([0.0, 60.0]), right, None, 0),
        _alone(range(20), np.array([60.0, 0.0]), up, None, 0),
        _alone(range(30, 50), np.array([60.0, 60.0]), right, 0, None),
        _alone(range(30, 50), np.array([60.0, 60.0]), up, 0, None),
    ]
    one, other = identities_of(decided)
    assert one.uncertain_after == other.uncertain_after == ()
    for identity in (one, other):
        before, after = identity.tracklets
        step = np.subtract(before.middles[-1], before.middles[0])
        assert np.allclose(step, np.subtract(after.middles[-1], after.middles[0]))
    still = np.zeros(2)
    undecided = [
        _alone(range(20), np.array([50.0, 60.0]), still, None, 0),
        _alone(range(20), np.array([70.0, 60.0]), still, None, 0),
        _alone(range(60, 80), np.array([60.0, 50.0]), still, 0, None),
        _alone(range(60, 80), np.array([60.0, 70.0]), still, 0, None),
    ]
    assert [one.uncertain_after for one in identities_of(undecided)] == [(19,), (19,)]


@pytest.fixture(scope="module")
def dish(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, AnimalsFacts]:
    """A film of two animals that cross, captured."""
    folder = tmp_path_factory.mktemp("dish")
    film = folder / "dish.avi"
    size = (PAIR.columns, PAIR.rows)
    writer = cv2.VideoWriter(str(film), cv2.VideoWriter.fourcc(*"MJPG"), PAIR.rate_hz, size)
    for frame in crossing_film(PAIR, crossing_midlines(PAIR)):
        writer.write(cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR))
    writer.release()
    options = film_options(
        film, folder / "track.npz", animals="auto", review=folder / "page.html",
        overlay=folder / "film.avi", sheet=folder / "sheet.png",
    )  # fmt: skip
    return folder, capture_several(options)


def test_each_animal_has_a_track_without_the_frames_in_contact(
    dish: tuple[Path, AnimalsFacts],
) -> None:
    folder, facts = dish
    assert [one.fault for one in facts.animals] == [None, None]
    truth = crossing_midlines(PAIR)
    names = set()
    for one in facts.animals:
        held = load_capture(folder / f"track-{one.animal}.npz")
        captured = held.captured
        assert captured.status.count(FrameStatus.MERGED) == one.frames_merged > 0
        assert captured.used.sum() >= 24 - one.frames_merged - 2
        name = int(np.argmin([point_error(captured.points_px[0], line[0]) for line in truth]))
        names.add(name)
        for k in np.flatnonzero(captured.used):
            assert point_error(captured.points_px[k], truth[name, k]) < 2.0
        assert captured.head_by == "travel"
    assert names == {0, 1}
    assert (folder / "film.avi").exists()
    sheet = cv2.imread(str(folder / "sheet.png"))
    assert sheet is not None
    high, wide = sheet.shape[:2]
    assert high % 4 == wide % 6 == 0, "two rows of six frames for each animal"
    assert abs(high // 4 - wide // 6) < 60, "a tile, without what is black, and its lines"


@pytest.mark.parametrize("as_json", [False, True])
def test_the_command_exits_with_a_code_if_an_animal_has_no_track(
    dish: tuple[Path, AnimalsFacts], *, as_json: bool
) -> None:
    _, facts = dish
    show_facts(facts, as_json=as_json)
    lost = replace(facts.animals[0], capture=None, fault="the body is never completely visible")
    with pytest.raises(SystemExit) as stopped:
        show_facts(replace(facts, animals=(lost, *facts.animals[1:])), as_json=as_json)
    assert stopped.value.code == 1


def test_the_page_shows_all_animals(dish: tuple[Path, AnimalsFacts]) -> None:
    folder, _ = dish
    text = (folder / "page.html").read_text()
    data = json.loads(text.split('id="data">')[1].split("</script>")[0])
    assert [one["name"] for one in data["animals"]] == ["dish-1", "dish-2"]
    tracks = [load_capture(folder / f"track-{k}.npz").fingerprint for k in (1, 2)]
    assert [one["track"] for one in data["animals"]] == tracks
    assert len(data["images"]) == 24


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("name", "wide"), [("t.csv", False), ("t.csv", True), ("t.wcon", False)])
def test_tables_of_all_animals_are_read_back_identically(
    dish: tuple[Path, AnimalsFacts], tmp_path: Path, name: str, wide: bool
) -> None:
    folder, _ = dish
    held = [load_capture(folder / f"track-{k}.npz") for k in (1, 2)]
    for scale in (None, 0.001):
        write_captures(tmp_path / name, [replace(one, m_per_px=scale) for one in held], wide=wide)
        for number in (1, 2):
            one = replace(held[number - 1], m_per_px=scale)
            save_capture(tmp_path / "one.npz", one)
            expected = load_file(tmp_path / "one.npz")
            again = load_file(tmp_path / name, choice=Choice(individual=f"dish-{number}"))
            assert again.rate_hz == pytest.approx(expected.rate_hz, rel=1e-12)
            np.testing.assert_array_equal(again.angles_rad, expected.angles_rad)
            if scale is not None:
                np.testing.assert_array_equal(again.points, expected.points)
                assert again.length_m == expected.length_m
            np.testing.assert_allclose(again.points, expected.points, rtol=1e-14)
            assert again.status == expected.status
            assert FrameStatus.GOOD in again.status
            assert again.head_sure == expected.head_sure is not None
            assert again.name == expected.name
            if name.endswith(".wcon"):
                assert again.source == expected.source != "not stated"


def test_two_animals_in_a_film_of_one_are_rejected() -> None:
    scene = CrossingScene(animals=2, rows=120, columns=160, length_px=40.0, frames=4)
    images = list(crossing_film(scene, crossing_midlines(scene)))
    with pytest.raises(InputError, match="several animals: give --animals"):
        capture(images, make_detector(images), 15.0)


@pytest.mark.nightly("a further film: 13 s of CPU")
def test_a_film_that_is_mostly_lost_names_the_option_that_captures_it(
    dish: tuple[Path, AnimalsFacts], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The fixture shows that the option gives a track of each animal."""
    folder, _ = dish
    options = film_options(folder / "dish.avi", tmp_path / "t.npz")
    capture_film(options)
    assert "with --animals auto; look at" in caplog.text
    assert (tmp_path / "t-tried.png").exists()


@pytest.mark.slow
def test_what_does_not_fit_several_animals_is_rejected(
    dish: tuple[Path, AnimalsFacts], tmp_path: Path
) -> None:
    folder, _ = dish
    plain = film_options(folder / "dish.avi", tmp_path / "t.npz", animals="2")
    with pytest.raises(InputError, match=r"--animals 5: \d animals can be followed"):
        capture_several(changed(plain, animals="5"))
    with pytest.raises(InputError, match="--animals many: expected a number"):
        capture_several(changed(plain, animals="many"))
    with pytest.raises(InputError, match="--animals and --steps"):
        capture_several(changed(plain, steps=tmp_path / "s.png"))
    with pytest.raises(InputError, match="--wide"):
        capture_several(changed(plain, wide=True))
    with pytest.raises(InputError, match="--review"):
        capture_several(changed(plain, output=tmp_path / "t.csv", review=tmp_path / "r.html"))
    assert list(tmp_path.iterdir()) == []


def test_a_part_of_an_animal_that_joins_it_again_is_no_contact() -> None:
    """A tail that appears apart from its body in one frame, and is one with it in the next."""
    body, tail, between = np.s_[10:18, 5:45], np.s_[21:30, 33:45], np.s_[18:21, 33:45]
    builder = TrackletBuilder(320.0)
    ground = np.full((40, 60), 200, dtype=np.uint8)
    detector = BodyDetector(ground, Polarity.DARK, "given", threshold=60.0)
    for parts in [[body]] * 6 + [[body, tail]] + [[body, tail, between]] * 6:
        image = ground.copy()
        for part in parts:
            image[part] = 50
        builder.add(blobs_of(image, detector))
    (one,) = builder.done()
    assert len(one.frames) == 13
    assert one.ends_in is None


@pytest.mark.nightly("a further film: 5 s of CPU")
def test_an_interrupted_capture_of_several_animals_is_continued(
    dish: tuple[Path, AnimalsFacts], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film_parts, "PART_FRAMES", 6)
    folder, facts = dish
    plain = film_options(folder / "dish.avi", tmp_path / "t.npz", animals="2")
    seen: list[int] = []
    add, most = FilmParts.add, [18]

    def counted(self: FilmParts, frame: DeepImage, detection: Detection) -> None:
        if len(seen) == most[0]:
            raise KeyboardInterrupt
        seen.append(0)
        add(self, frame, detection)

    monkeypatch.setattr(FilmParts, "add", counted)
    with pytest.raises(KeyboardInterrupt) as stop:
        capture_several(plain)
    assert "continue by --resume" in stop.value.__notes__[0]
    with pytest.raises(InputError, match="its capture has other values of animals"):
        capture_several(changed(plain, resume=True, animals="auto"))
    seen.clear()
    most[0] = 10**6
    again = capture_several(changed(plain, resume=True))
    used = [one.capture.frames_used for one in again.animals if one.capture is not None]
    assert len(used) == 2
    assert len(seen) < sum(used), "finished parts are not captured again"
    assert not (tmp_path / "t.npz.part").exists()
    for number, one in enumerate(facts.animals, start=1):
        assert one.capture is not None
        before = load_capture(Path(one.capture.track)).captured
        after = load_capture(tmp_path / f"t-{number}.npz").captured
        both = before.used & after.used
        assert both.sum() >= before.used.sum() - 2
        assert float(np.abs(after.points_px - before.points_px)[both].max()) < 1.0


def test_a_followed_animal_needs_a_few_bytes_a_frame() -> None:
    one = Tracklet(None)
    step, shape = np.array([0.5, 0.25]), np.log([50.0, 4.0, 90.0])
    tracemalloc.start()
    for frame in range(20_000):
        one.place(frame, 3, frame * step, shape + frame * 1e-4)
    assert tracemalloc.get_traced_memory()[0] < 20_000 * 16
    tracemalloc.stop()
    assert one.frames == range(20_000)
    assert np.allclose(one.middles[-1], 19_999 * step)
    assert len(one.shapes) < 2100
    assert np.allclose(np.median(one.shapes, axis=0), shape + 1.0, atol=0.01)


def test_objects_that_are_too_small_for_an_animal_are_counted() -> None:
    scene = replace(PLATE, animals=3, rows=260, columns=320, frames=12, seed=3102)
    images = list(crossing_film(scene, crossing_midlines(scene)))
    for k, image in enumerate(images):
        cv2.line(image, (20 + 4 * k, 12), (28 + 4 * k, 12), 70, 2)
    detector = detector_of_several(images)
    found = find_animals(images, images, detector, requested_count=None, name="film")
    assert len(found.identities) == 3
    assert found.smaller == 1


def test_an_animal_in_contact_for_the_rest_of_the_film_counts() -> None:
    here, step = np.array([20.0, 20.0]), np.array([0.1, 0.0])

    def counts(frames: range, begins: int | None, ends: int | None) -> bool:
        (only,) = identities_of([_alone(frames, here, step, begins, ends)])
        return only.is_animal(90)

    assert counts(range(45), None, None)
    assert not counts(range(43), None, None)
    assert counts(range(43), None, 0)
    assert counts(range(50, 90), 0, None)
    assert not counts(range(10), None, 0), "alone for too short a time"
    assert not counts(range(30, 60), 0, 1), "a part between two contacts"


def test_a_gap_is_bridged_soon_after_it_only() -> None:
    here, step = np.array([20.0, 20.0]), np.array([0.1, 0.0])
    soon = [
        _alone(range(20), here, step, None, None),
        _alone(range(30, 50), here, step, None, None),
    ]
    late = [
        _alone(range(20), here, step, None, None),
        _alone(range(60, 80), here, step, None, None),
    ]
    assert len(identities_of(soon)) == 1
    assert len(identities_of(late)) == 2


@pytest.mark.parametrize(
    ("parts", "status"),
    [
        ([], FrameStatus.NOTHING),
        ([np.s_[10:18, 5:45]], FrameStatus.PART),
        ([np.s_[10:18, 5:45], np.s_[18:34, 24:28], np.s_[30:38, 5:45]], FrameStatus.MERGED),
    ],
)
def test_an_animal_touches_another_only_in_one_silhouette(
    parts: list[tuple[slice, slice]], status: FrameStatus
) -> None:
    """Animals of 320 pixels; far away, two others touch."""
    ground = np.full((60, 300), 200, dtype=np.uint8)
    image = ground.copy()
    for part in [*parts, np.s_[10:26, 250:290]]:
        image[part] = 50
    detector = BodyDetector(ground, Polarity.DARK, "given", threshold=60.0)
    blobs = blobs_of(image, detector)
    others = [k for k in range(len(blobs.area_px)) if parts or blobs.middle_px[k, 0] < 200.0]
    assert merged_status(blobs, others, np.array([25.0, 14.0]), 320.0) is status
